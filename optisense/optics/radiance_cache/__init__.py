"""The radiance cache: the light that falls on the undeformed surfaces, kept between images.

Photons come in. They are tallied in surface cells and bins of direction (`cache`), smoothed
(`smoothing`) and kept for the next image (`store`). `shading` looks the light up for visible
points, with the occlusion and the interreflection that contacts add.
"""
