"""The names of the two models of a skin under contacts."""

CONFORMING = "conforming"
"""The model in which the skin takes an indenter's shape where they overlap, and rests elsewhere."""
ELASTIC = "elastic"
"""The model in which the skin deforms like an elastic layer on a rigid base, also around a
contact."""
SKINS = ELASTIC, CONFORMING
