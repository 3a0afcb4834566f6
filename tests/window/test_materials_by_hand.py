"""A material of the library becomes one's own and is used, by mouse and keys.

The steps build on one another, as a user's do.
"""

from __future__ import annotations

import numpy as np
import yaml
from PIL import Image

from .bench import Bench
from .test_by_hand import ABOVE_BUTTON

ON_GEL = (12.625, -5.0, -3.2)
"""mm, a place on the gel's side, which the view shows, and where no line of the cage is near."""

OF_LIBRARY, NAME = "pdms-soft", "my-soft-gel"
INDEX = 1.43
"""Of the user's own material; no material of the library has it."""

TO_NAME = 100
"""Pixels from the button that asks for a name, to the left, to the field for it."""

CHOICE = "manager.optisense_material"
GALLERY = "part('materials.gallery')"
GEL = "bpy.data.objects['gel'].optisense.material"
OWN_PICTURE = f"{GALLERY}.picture('material', {NAME!r})"


def test_a_material_of_the_library_is_put_on_the_gel(bench: Bench) -> None:
    bench.greet()
    bench.open_tab()
    bench.new_sensor("gelsight-mini-ideal")
    bench.select_part("gel", ON_GEL)
    names = bench.see("[e['name'] for e in part('engine.catalogue').entries('material')]")
    bench.choose(bench.find("material", across=0.4), names.index(OF_LIBRARY))
    bench.until(f"{CHOICE}.material == {OF_LIBRARY!r}")
    bench.press("optisense.apply_material")
    bench.until(f"{GEL} == {OF_LIBRARY!r}")


def test_one_number_is_changed_and_it_is_kept_as_ones_own(bench: Bench) -> None:
    bench.enter("number", str(INDEX))  # the first one: the refractive index
    bench.until(f"abs(scene().optisense.materials[{GEL}].fields['ior'].number - {INDEX}) < 1e-6")
    x, y = bench.find("optisense.keep_material")
    bench.desktop.click(x, y)
    bench.see("1")
    bench.drawn()
    bench.photograph("own-asked")
    bench.enter_at((x - TO_NAME, y), NAME)
    bench.see("1")
    bench.desktop.keys("Return")  # OK
    bench.until(f"{NAME!r} in state().note")
    assert not bench.see("state().problem"), bench.said()
    bench.until(f"any(e['name'] == {NAME!r} for e in part('engine.catalogue').entries('material'))")
    assert bench.see(f"{CHOICE}.material") == bench.see(GEL), "another one is not chosen by that"
    bench.bring("optisense.keep_material", 0.8)
    bench.photograph("own-kept")


def test_its_picture_is_in_the_gallery(bench: Bench) -> None:
    bench.press("optisense.material_pictures", across=0.9)
    bench.until(f"{GALLERY}.is_begun('material')")
    bench.until(f"{GALLERY}.waiting('material') == 0")
    picture = np.asarray(Image.open(bench.see(OWN_PICTURE)).convert("RGB"), dtype=float)
    assert picture.std() > 20.0, "a ball on a chequered floor"
    _, y = bench.bring("optisense.material_pictures", 0.7, across=0.9)
    left, _, width, _ = bench.sidebar()
    bench.desktop.click(left + width / 2, y - ABOVE_BUTTON)
    bench.see("1")
    bench.drawn()
    bench.photograph("own-gallery")
    bench.desktop.keys("Escape")
    bench.see("1")


def test_it_is_put_on_the_gel_and_saved_with_the_design(bench: Bench) -> None:
    names = bench.see("[e['name'] for e in part('engine.catalogue').entries('material')]")
    bench.choose(bench.find("material", across=0.4), names.index(NAME))
    bench.until(f"{CHOICE}.material == {NAME!r}")
    bench.press("optisense.apply_material")
    bench.until(f"{GEL} == {NAME!r}")
    bench.photograph("own-applied")
    bench.press("optisense.save_as", across=0.85)
    bench.choose_file()
    bench.until("scene().optisense.is_saved")
    bench.rest()
    written = yaml.safe_load((bench.home / "gelsight-mini-ideal" / "design.yaml").read_text())
    assert written["parts"]["gel"]["material"] == NAME
    assert written["materials"][NAME]["ior"] == INDEX
