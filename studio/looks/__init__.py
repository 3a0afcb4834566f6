"""Drawing of a sensor in 3D views, beside its objects: outlines, lit lamps, beams, sections."""
