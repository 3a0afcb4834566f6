"""Balls in a picture are distinguished, counted and outlined."""

from __future__ import annotations

import numpy as np

from optisense.report.trial_pictures import count_in_words, find_balls, marks_svg


def test_each_pixel_belongs_to_the_nearest_ball_and_pieces_are_outlined() -> None:
    points = np.zeros((40, 60, 3), dtype=np.float32)
    points[..., 0] = np.arange(60)
    mask = np.zeros((40, 60), dtype=bool)
    mask[5:15, 5:15] = mask[25:35, 5:15] = True  # one ball, which a folded mirror shows twice
    mask[10:13, 40:45] = True
    mask[30, 55] = True
    balls = find_balls(points, mask, np.array([[10.0, 0, 0], [42.0, 0, 0], [55.0, 0, 0]]))
    assert [ball.pixels for ball in balls] == [200, 15, 1]
    assert [ball.seen for ball in balls] == [True, True, False]
    assert [len(ball.outlines) for ball in balls] == [2, 1, 0]
    low, high = balls[1].outlines[0].min(axis=0), balls[1].outlines[0].max(axis=0)
    assert (low < (40, 10)).all() and (high > (45, 13)).all()
    svg = marks_svg(balls, 60, 40)
    assert svg.count("<polygon") == 3
    assert ">1</text>" in svg and ">3</text>" not in svg
    assert count_in_words(balls) == "2 of the 3 are in view; 3 is hidden, or too small to make out."
    assert count_in_words(balls[:2]) == "All 2 are in view."
    assert count_in_words(()) == ""
