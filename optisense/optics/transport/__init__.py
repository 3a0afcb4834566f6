"""Light transport: photons from the emitters, paths from the camera, chief rays, derivatives.

The functions take a ray scene and return photon maps, visible points and chief rays; no state is
kept between calls.
"""
