"""From visible points to a tactile image: the film, adaptive sampling, and the two estimators.

`cached` reads the radiance cache; `sppm` is stochastic progressive photon mapping, the reference.
"""
