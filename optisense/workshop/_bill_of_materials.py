"""Bill of materials of a sensor: lights, camera, materials by volume, and the coated area."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass

from optisense.design import Role, SensorDesign, Status
from optisense.library import OVERDRIVEN, AnyEntry, nominal_flux, typical_colour
from optisense.library.facts import summary
from optisense.text import cell, markdown
from optisense.workshop._placement import what_to_order
from optisense.workshop._tables import entry_or_none, light_entry
from optisense.workshop.shapes import Shape, shapes
from optisense.writing import csv_table

MM2_PER_CM2, MM3_PER_CM3 = 100.0, 1000.0
"""Square millimetres in a square centimetre, and cubic ones in a cubic centimetre."""


@dataclass(frozen=True)
class Item:
    """Line of the bill.

    Attributes:
        kind: light, camera, material or coating.
        name: name in the design.
        quantity: quantity, in `unit`.
        unit: pieces, cm^3 or cm^2.
        used_for: light group or part that uses it.
        description: description.
        maker: vendor, "" if unknown.
        part: the maker's order number, or an acceptable replacement if it is unknown.
        package: width x length x height of a light, mm, "" if unknown.
        note: remarks.
        designators: designators of lights, as in the tables of positions, such as D1-D5.
    """

    kind: str
    name: str
    quantity: float
    unit: str
    used_for: str
    description: str = ""
    maker: str = ""
    part: str = ""
    package: str = ""
    note: str = ""
    designators: str = ""


@dataclass(frozen=True)
class Bill:
    """Bill of materials.

    Attributes:
        title: name of the design.
        items: lines of the bill.
    """

    title: str
    items: list[Item]

    def csv(self) -> str:
        """Return the bill as a table (RFC 4180)."""
        head = ("kind", "name", "quantity", "unit", "used for", "description", "maker", "part",
                "package_mm", "note", "designators")  # fmt: skip
        rows = [
            (item.kind, item.name, f"{item.quantity:.4g}", *map(cell, astuple(item)[3:]))
            for item in self.items
        ]
        return csv_table(head, rows)

    def markdown(self) -> str:
        """Return the bill as Markdown, with a table for each kind."""
        lines = [f"# Bill of materials: {markdown(self.title)}", ""]
        for kind, heading in HEADINGS.items():
            items = [item for item in self.items if item.kind == kind]
            if items:
                lines += [f"## {heading}", "", *_table(items), ""]
        return "\n".join(lines)


HEADINGS = {"light": "Lights", "camera": "Camera", "material": "Materials", "coating": "Coating"}


def bill_of_materials(design: SensorDesign) -> Bill:
    """Return the bill of materials of a design.

    Volumes are those of the parts as drawn: where parts overlap, the overlap counts in each.

    Raises:
        DesignError: a part has no mesh, or lies outside of the cage that deforms it.
    """
    made = shapes(design)
    items = [*_lights(design), _camera(design)]
    items += [_material(design, shape) for shape in made if shape.role is not Role.SENSING_SURFACE]
    items += _coating(design, [s for s in made if s.role is Role.SENSING_SURFACE])
    return Bill(design.name, items)


def _lights(design: SensorDesign) -> list[Item]:
    items: list[Item] = []
    count = 0
    for name, group in design.lights.items():
        first, count = count + 1, count + len(group.lights)
        entry, colour = light_entry(group), typical_colour(group.model, group.colour)
        description, maker = _words(entry)
        if entry is None and group.emitter is not None:
            description += f": {group.emitter.in_words()}"
        package = entry.package if entry is not None else None
        note = f"{group.flux:g} mW each"
        if colour is not None:
            note = f"{colour[0]}, {note}"
        nominal = nominal_flux(group.model, group.colour)
        if nominal is not None:
            known = entry.source(f"flux.{nominal.colour}") if entry is not None else None
            assumed = known is not None and known.status is Status.ASSUMED
            note += f"; nominal {nominal.words}{' (assumed)' if assumed else ''}"
            times = group.flux / nominal.flux
            if times > OVERDRIVEN:
                note += f": {times:.2g} times its nominal flux is asked of it"
        items.append(
            Item(
                kind="light",
                name=group.model,
                quantity=len(group.lights),
                unit="pieces",
                used_for=name,
                description=description,
                maker=maker,
                part=what_to_order(group),
                package=" x ".join(f"{length:g}" for length in package) if package else "",
                note=note,
                designators=f"D{first}" if first == count else f"D{first}-D{count}",
            )
        )
    return items


def _camera(design: SensorDesign) -> Item:
    camera = design.camera
    description, maker = _words(entry_or_none("camera", camera.model))
    note = f"{camera.fov:g} degrees across, {camera.projection}, used at "
    note += "{} x {} pixels".format(*camera.resolution)
    return Item(
        kind="camera",
        name=camera.model,
        quantity=1,
        unit="pieces",
        used_for="camera",
        description=description,
        maker=maker,
        note=note,
    )


def _material(design: SensorDesign, shape: Shape) -> Item:
    name = shape.material or "any black"
    description, maker, note = "absorbs all light" if shape.material is None else "", "", ""
    if shape.material is not None:
        value = design.materials[shape.material]
        entry = entry_or_none("material", shape.material)
        description = f"described in the design, {value.kind}"
        if entry is not None:
            description, maker = entry.description, entry.maker or ""
            if entry.value != value:
                note = f"as changed in the design; the library has {summary(entry)}"
        medium = value.medium()
        if medium is not None:
            note = "; ".join(filter(None, [f"index {medium.ior:g}", note]))
    volume = shape.volume
    note = "; ".join(filter(None, [note, _drawn(design, shape)]))
    return Item(
        kind="material",
        name=name,
        quantity=shape.mesh.area / MM2_PER_CM2 if volume is None else volume / MM3_PER_CM3,
        unit="cm^2" if volume is None else "cm^3",
        used_for=f"{shape.name} ({shape.role.value})",
        description=description,
        maker=maker,
        note=note,
    )


def _drawn(design: SensorDesign, shape: Shape) -> str:
    """Return remarks for the maker on how a part is drawn: a sheet has no thickness, and
    assumptions about it may be changed.
    """
    sheet = "" if shape.is_solid else "a sheet without thickness"
    if shape.thickness is not None:
        path = f"parts.{shape.name}.thickness"
        assumed = _assumed(design, path)
        sheet = f"a sheet, made {shape.thickness:g} mm thick" + (f" ({assumed})" if assumed else "")
    return "; ".join(filter(None, [sheet, _assumed(design, f"parts.{shape.name}")]))


def _assumed(design: SensorDesign, path: str) -> str:
    """Return the assumption about a part or a number of it; empty if there is none."""
    known = design.provenance.get(path)
    if known is None or known.status is not Status.ASSUMED or not known.source:
        return ""
    return f"assumed: {known.source}"


def _coating(design: SensorDesign, coated: Sequence[Shape]) -> list[Item]:
    coating = design.coating
    entry = entry_or_none("coating", coating.library) if coating.library else None
    description, maker = _words(entry)
    return [
        Item(
            kind="coating",
            name=coating.library or "coating",
            quantity=shape.mesh.area / MM2_PER_CM2,
            unit="cm^2",
            used_for=f"{shape.name} ({shape.role.value})",
            description=description,
            maker=maker,
            note="; ".join(
                filter(None, [coating.in_words(), _assumed(design, f"parts.{shape.name}")])
            ),
        )
        for shape in coated
    ]


def _words(entry: AnyEntry | None) -> tuple[str, str]:
    """Return the description of an entry of the library, and its maker."""
    if entry is None:
        return "described in the design", ""
    return entry.description, entry.maker or ""


def _table(items: Sequence[Item]) -> list[str]:
    """Return a Markdown table without the columns that are empty."""
    columns = {
        "name": [item.name for item in items],
        "quantity": [f"{item.quantity:.3g} {item.unit}" for item in items],
        "designators": [item.designators for item in items],
        "for": [item.used_for for item in items],
        "what it is": [item.description for item in items],
        "maker": [item.maker for item in items],
        "part": [item.part for item in items],
        "package (mm)": [item.package for item in items],
        "note": [item.note for item in items],
    }
    kept = {title: cells for title, cells in columns.items() if any(cells)}
    rows = [list(kept), *zip(*kept.values(), strict=True)]
    lines = ["| " + " | ".join(markdown(text) for text in row) + " |" for row in rows]
    return [lines[0], "| " + " | ".join(["---"] * len(kept)) + " |", *lines[1:]]
