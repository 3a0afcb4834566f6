"""Score one point of a search space: a pure function of the design, the point and the seed.

This package depends on neither studies nor methods. Robust scores repeat the scoring over
manufacturing errors.
"""
