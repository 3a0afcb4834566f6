"""Whether STEP files can be read and written here, and STEP files of given shapes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest


def _imports() -> bool:
    try:
        import OCP.STEPCAFControl  # noqa: F401
    except ImportError:
        return False
    return True


needs_step = pytest.mark.skipif(
    not _imports(), reason="the extra 'step', or libGL for it, is not installed"
)


def write_step(path: Path, parts: dict[str, tuple[Any, ...]], unit: str = "MM") -> Path:
    """An assembly of named shapes, each with one copy or several, moved along x by some mm."""
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.Interface import Interface_Static
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document = TDocStd_Document(TCollection_ExtendedString("XmlOcaf"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    assembly = tool.NewShape()
    TDataStd_Name.Set_s(assembly, TCollection_ExtendedString("sensor"))
    for name, (shape, *shifts) in parts.items():
        label = tool.AddShape(shape, False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
        for shift in shifts:
            move = gp_Trsf()
            move.SetTranslation(gp_Vec(shift, 0, 0))
            tool.AddComponent(assembly, label, TopLoc_Location(move))
    tool.UpdateAssemblies()
    writer = STEPCAFControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", unit)
    writer.SetNameMode(True)
    writer.Transfer(document)
    writer.Write(str(path))
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    return path
