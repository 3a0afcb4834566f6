"""The two ways in which a skin can follow what presses on it."""

CONFORMING = "conforming"
"""The skin takes an indenter's shape where both overlap, and stays as it is elsewhere."""
ELASTIC = "elastic"
"""The skin is that of an elastic layer on a rigid base: it is also pulled in around a contact."""
SKINS = ELASTIC, CONFORMING
