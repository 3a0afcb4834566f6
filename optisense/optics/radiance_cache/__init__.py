"""The radiance cache: the light that falls on the undeformed surfaces, kept between images.

Photons are tallied in surface cells and direction bins (`cache`), smoothed (`smoothing`) and kept
for the next image (`store`). `shading` evaluates the cache at visible points and adds the occlusion
and the interreflection of contacts.
"""
