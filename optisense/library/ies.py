"""IES files of lights; the reader is shared with designs that contain their own file."""

from optisense.design.ies import IesProfile, parse_ies, read_ies

__all__ = ["IesProfile", "parse_ies", "read_ies"]
