"""GelSight Mini, fitted to photographs of a real unit.

`optisense calibrate` has fitted the powers of the lights, the camera's place and its processing to
published photographs; `scripts/fitted_mini.py` repeats the fit. The numbers are in a YAML file
beside this module.
"""

from __future__ import annotations

from importlib.resources import as_file, files

from optisense.design import Provenance, SensorDesign, Status, set_value
from optisense.design.yaml_reader import read_yaml
from optisense.sensors.gelsight_mini import NAME, gelsight_mini

FITTED_NUMBERS = "gelsight_mini_fitted.yaml"
"""Name of the file with the value at each fitted path, and its source."""

VIEW_WIDTH = 20.3
"""Width of the skin that pictures of real units show, mm, from the size of balls in them; the
maker's datasheet states 18.6.
"""

GUIDE_SIZE = 28.23, 23.73
"""Size of a light guide as large as the tray, mm: with one as large as the gel, pictures have a
green border that no real unit shows.
"""


def unfitted_design() -> SensorDesign:
    """Return the design that the fit starts from: a flat GelSight Mini with a wide view and
    guide.
    """
    design = gelsight_mini(view_width=VIEW_WIDTH, guide_size=GUIDE_SIZE)
    design.name = f"{NAME}-fitted"
    design.description = "GelSight Mini, flat gel, fitted to photographs of a real unit"
    assumed = Status.ASSUMED
    width, height = GUIDE_SIZE
    design.provenance["parts.guide"] = Provenance(
        status=assumed,
        source=f"{width:g} x {height:g} x 4 mm acrylic, as large as the tray: so photographs show "
        "no green border",
    )
    design.provenance["camera.fov"] = Provenance(
        status=Status.DERIVED,
        source=f"the width that shows {VIEW_WIDTH:g} mm of the flat gel, as photographs of balls "
        "do, refracted through air, acrylic and gel; from the assumed pupil",
    )
    return design


def gelsight_mini_fitted() -> SensorDesign:
    """Build a GelSight Mini whose light and camera are those of a real unit.

    Its camera mixes colours, and has a tone curve, a black level and dark corners. So its pictures
    resemble those of the unit, and scores of pictures differ from those of `gelsight_mini`, whose
    camera is ideal.
    """
    design = unfitted_design()
    with as_file(files("optisense.sensors") / FITTED_NUMBERS) as path:
        fitted, _ = read_yaml(path)
    for place, entry in fitted.items():
        design = set_value(design, place, entry["value"])
        design.provenance[place] = Provenance(status=Status.CALIBRATED, source=entry["source"])
    return design
