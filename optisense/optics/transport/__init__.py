"""Light on its way: photons from the emitters, paths from the camera, chief rays, derivatives.

A ray scene comes in. Photon maps, visible points and chief rays go out; nothing is kept.
"""
