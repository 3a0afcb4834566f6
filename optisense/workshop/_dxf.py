"""Outlines as DXF drawings of release 12, in mm, for cutters and board makers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

from optisense.workshop._tables import digits

Pair = tuple[int, str | float]
"""Group code of DXF and its value; lengths are in mm and angles in degrees."""


HEADER = {"$ACADVER": (1, "AC1009"), "$INSUNITS": (70, "4"), "$MEASUREMENT": (70, "1")}
"""Variables of the header: the format of release 12, lengths in mm, and metric patterns. The last
two are of later releases; those of release 12, which has no units, skip unknown variables."""


def dxf(entities: Iterable[Sequence[Pair]]) -> str:
    """Return the text of a DXF file with these entities, whose header states the unit mm."""
    lines = ["0", "SECTION", "2", "HEADER"]
    for name, (code, value) in HEADER.items():
        lines += ["9", name, str(code), value]
    lines += ["0", "ENDSEC", "0", "SECTION", "2", "ENTITIES"]
    for entity in entities:
        for code, given in entity:
            lines += [str(code), given if isinstance(given, str) else digits(float(given), 4)]
    return "\n".join([*lines, "0", "ENDSEC", "0", "EOF", ""])


def line(layer: str, start: Sequence[float], end: Sequence[float]) -> list[Pair]:
    """Return a straight line between two points (x, y), mm."""
    return [(0, "LINE"), (8, layer), (10, start[0]), (20, start[1]), (30, 0.0),
            (11, end[0]), (21, end[1]), (31, 0.0)]  # fmt: skip


def arc(layer: str, centre: Sequence[float], radius: float, start: float, end: float) -> list[Pair]:
    """Return an arc about a centre (x, y), mm, anticlockwise from `start` to `end`, degrees."""
    return [(0, "ARC"), (8, layer), (10, centre[0]), (20, centre[1]), (30, 0.0), (40, radius),
            (50, start), (51, end)]  # fmt: skip


def circle(layer: str, centre: Sequence[float], radius: float) -> list[Pair]:
    """Return a circle about a centre (x, y) with a radius, mm."""
    return [(0, "CIRCLE"), (8, layer), (10, centre[0]), (20, centre[1]), (30, 0.0), (40, radius)]


def closed(layer: str, corners: Sequence[Sequence[float]]) -> list[list[Pair]]:
    """Return lines from each corner (x, y), mm, to the next, and back to the first."""
    return [line(layer, a, b) for a, b in pairwise([*corners, corners[0]])]
