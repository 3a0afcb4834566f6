"""The profiles of a comparison say what they show."""

from __future__ import annotations

import numpy as np

from optisense.report._files import template
from optisense.report.comparison import profile_figure


def test_both_axes_of_a_profile_have_a_label_with_their_unit() -> None:
    response = np.zeros((30, 40, 3))
    figure = profile_figure(response, response, (20.0, 15.0), 5.0)
    for axes in figure.axes:
        assert axes.get_xlabel().endswith("from the contact's middle")
        assert axes.get_ylabel() == "response, levels of 255"


def test_every_figure_at_the_top_of_the_page_is_defined() -> None:
    words = template("comparison_body.html.j2").lower()
    for name in ("unexplained", "similarity", "background", "exposure"):
        assert f"<b>{name}</b>" in words
