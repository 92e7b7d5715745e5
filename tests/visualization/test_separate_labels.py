"""Labels of drawings are moved apart where they overlap."""

from __future__ import annotations

import pytest

from stairmap.visualization.dimensions import draw_label, plain_text, separate_labels

pytest.importorskip("matplotlib", reason="needs the extra report")

from stairmap.visualization.plots import make_figure


def test_labels_at_one_place_end_up_apart_and_the_first_stays() -> None:
    figure = make_figure(width=6, height=6)
    axes = figure.subplots()
    axes.set_xlim(0, 10)
    axes.set_ylim(0, 10)
    for number in range(6):
        draw_label(axes, (5.0, 5.0 + 0.02 * number), f"stairway {number}\nto floor 1, 45 s")
    draw_label(axes, (1.0, 1.0), "alone")
    separate_labels(figure)
    boxes = [text.get_window_extent() for text in axes.texts]
    assert not [(a, b) for a in range(7) for b in range(a) if boxes[a].overlaps(boxes[b])]
    assert axes.texts[0].get_position() == (5.0, 5.0)
    assert axes.texts[-1].get_position() == (1.0, 1.0)


def test_dollars_and_control_characters_are_plain() -> None:
    assert plain_text("a$b\n") == "a\\$b\\n"
