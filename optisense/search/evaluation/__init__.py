"""Score one point of a search space: a pure function of the design, the point and the seed.

It knows neither studies nor methods. Robust scores repeat it over manufacturing errors.
"""
