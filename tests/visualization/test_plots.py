from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from flight_views import View, make_flight

from stairmap.arrays import Points
from stairmap.drop import Drop
from stairmap.errors import MissingPackageError
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory
from stairmap.visualization.convergence import ConvergenceRecorder, ConvergenceSample
from stairmap.visualization.plots import (
    draw_convergence,
    draw_overview,
    draw_stairway,
    make_figure,
    png_from_figure,
)

pytest.importorskip("matplotlib")


def texts(figure: object) -> list[str]:
    found = figure.findobj(lambda artist: hasattr(artist, "get_text"))  # type: ignore[attr-defined]
    return [text.get_text() for text in found if isinstance(text.get_text(), str)]


def test_measures_and_units_are_written_on_the_drawing(stairway: Stairway, nosings: Points) -> None:
    written = texts(draw_stairway(stairway, observed_nosings=nosings))
    for text in (
        "rise 165 ± 2 mm", "run 292 ± 3 mm", "width 1175 ± 20 mm", "pitch 29.5 ± 0.6°", "map x, m",
        "map z, m",
    ):  # fmt: skip
        assert text in written


def test_each_flight_has_an_elevation_and_an_unbounded_width_says_so(turning_stairway: Stairway) -> None:
    figure = draw_stairway(turning_stairway)
    assert len(figure.axes) == 3
    assert "width ≥ 900 ± 20 mm" in texts(figure)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_the_overview_draws_any_number_of_stairways(
    count: int, stairway: Stairway, turning_stairway: Stairway, trajectory: Trajectory, nosings: Points
) -> None:
    positions = trajectory.map_from_camera[:, :3, 3]
    chosen = [stairway, turning_stairway][:count]
    figure = draw_overview(chosen, positions=positions, observed_nosings=nosings)
    assert png_from_figure(figure).startswith(b"\x89PNG")
    assert ("no stairway was found" in texts(figure)) == (count == 0)


def test_a_single_step_and_a_flight_without_deviations_can_be_drawn(stairway: Stairway) -> None:
    flight = make_flight(num_risers=1, steps=())
    nan = float("nan")
    std = replace(flight.std, rise=nan, run=nan, width=nan, pitch=nan)
    single = replace(stairway, flights=(replace(flight, std=std),))
    figure = draw_stairway(single)
    assert "rise 165 mm" in texts(figure)
    assert png_from_figure(figure).startswith(b"\x89PNG")


def test_the_same_drawing_is_the_same_file_bit_for_bit(stairway: Stairway) -> None:
    assert png_from_figure(draw_stairway(stairway)) == png_from_figure(draw_stairway(stairway))


def test_convergence_is_divided_by_the_reference() -> None:
    samples = [
        ConvergenceSample(num_observations=n, measures={"rise": 0.2, "run": 0.3, "width": 1.0, "pitch": 0.5})
        for n in (1, 2, 5)
    ]
    reference = {"rise": 0.2, "run": 0.25, "width": 1.0}
    figure = draw_convergence(samples, reference=reference, reference_name="true value")
    lines = {str(line.get_label()): line for line in figure.axes[0].get_lines()}
    np.testing.assert_allclose(lines["run ÷ 250 mm"].get_ydata(), 1.2)
    np.testing.assert_allclose(lines["rise ÷ 200 mm"].get_xdata(), [1, 2, 5])
    assert not any(label.startswith("pitch") for label in lines)
    assert "estimate ÷ true value" in texts(figure)


def test_convergence_samples_grow_as_a_logarithm(stairway: Stairway) -> None:
    recorder = ConvergenceRecorder()
    for count in range(1, 10_001):
        if recorder.is_due(count):
            recorder.add([replace(stairway, num_observations=count)], count)
    samples = recorder.samples(1)
    assert len(samples) < 100
    assert [sample.num_observations for sample in samples[:4]] == [1, 2, 3, 4]
    assert samples[-1].num_observations > 8_000
    assert recorder.samples(99) == ()


def test_missing_matplotlib_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(MissingPackageError, match=r"stairmap\[report\]"):
        make_figure(width=1, height=1)


def test_drawing_leaves_pyplot_alone(stairway: Stairway, views: list[View]) -> None:
    before = "matplotlib.pyplot" in sys.modules
    draw_stairway(stairway)
    assert ("matplotlib.pyplot" in sys.modules) == before


def test_an_edge_of_the_ground_that_no_stairs_explain_says_how_deep_it_is(stairway: Stairway) -> None:
    drop = Drop(
        id=1, edge=[[4.0, 1.0, 0.0], [4.0, -1.0, 0.0]], depth=0.83, num_observations=9, first_seen_ns=0,
        last_seen_ns=1,
    )  # fmt: skip
    assert "≥ 0.83 m deep" in texts(draw_overview([stairway], drops=[drop]))
    own = replace(drop, stairway_id=stairway.id)
    figure = draw_overview([stairway], drops=[own])
    assert "≥ 0.83 m deep" not in texts(figure)
    assert "edge of the ground" in figure.axes[0].get_legend_handles_labels()[1]
    void = draw_overview([stairway], drops=[replace(drop, depth=None)])
    assert not any("deep" in text for text in texts(void))
    assert "edge of the ground, nothing seen behind" in void.axes[0].get_legend_handles_labels()[1]
