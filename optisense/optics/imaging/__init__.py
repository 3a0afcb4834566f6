"""The tactile image of visible points: the film, adaptive sampling, and the two estimators.

`cached` reads the radiance cache; `sppm` is stochastic progressive photon mapping, the reference.
"""
