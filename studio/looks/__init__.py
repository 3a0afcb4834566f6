"""How a sensor is drawn in 3D views, beside its objects: outlines, lit lamps, beams, sections."""
