"""Bags with elevation maps."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bag_files import Ros, write_bag
from command_line import stairmap
from elevation_bags import GRID_TOPIC, grid_message, stair_heights
from stairmap.errors import RecordingError
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.bags.elevation import ElevationRecording
from stairmap.recordings.bags.grid_message import grid_from_message
from stairmap.recordings.open import has_only_sweeps

HEIGHTS = stair_heights(0.05)


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
@pytest.mark.parametrize("start", [(0, 0), (7, 31)], ids=["from its corner", "from within"])
@pytest.mark.parametrize("is_row_major", [False, True])
def test_cells_lie_where_the_message_puts_them(kind: str, start: tuple[int, int], is_row_major: bool) -> None:
    message = grid_message(
        Ros(kind), HEIGHTS, 0.05, 5, middle=(10.0, -3.0), start=start, is_row_major=is_row_major
    )
    grid = grid_from_message(message)
    assert grid.stamp_ns == 5
    np.testing.assert_array_equal(grid.heights, HEIGHTS.astype(np.float32))
    np.testing.assert_allclose(grid.map_from_grid[:3, 3], [10 - 2.25, -3 - 2.25, 0.0])


def test_the_layer_is_that_of_heights_or_the_one_that_was_named() -> None:
    ros = Ros("mcap")
    message = grid_message(ros, HEIGHTS, 0.05, 5, layers=("variance", "elevation"))
    np.testing.assert_array_equal(grid_from_message(message).heights, HEIGHTS.astype(np.float32))
    assert not grid_from_message(message, "variance").heights.any()
    with pytest.raises(RecordingError, match=r"no layer slope; there are: variance, elevation"):
        grid_from_message(message, "slope")
    unknown = grid_message(ros, HEIGHTS, 0.05, 5, layers=("variance", "z"))
    with pytest.raises(RecordingError, match=r"name one, as in --cloud-topic TOPIC:LAYER"):
        grid_from_message(unknown)
    assert grid_from_message(grid_message(ros, HEIGHTS, 0.05, 5, layers=("z",))).heights.any()


def test_a_map_of_another_size_than_it_says_is_refused() -> None:
    message = grid_message(Ros("mcap"), HEIGHTS, 0.05, 5)
    message.info.length_x = 3.0
    with pytest.raises(RecordingError, match=r"60 x 90 cells of 0.05 m by its info"):
        grid_from_message(message)
    message = grid_message(Ros("mcap"), HEIGHTS, 0.05, 5)
    message.data[0].data = message.data[0].data[:-1]
    with pytest.raises(RecordingError, match="90 x 90 cells, but it has 8099"):
        grid_from_message(message)


def bag_of(folder: Path, *, num: int, kind: str = "mcap", **options: object) -> Path:
    """A robot that comes nearer, with the same map about it."""
    ros = Ros(kind)
    messages = [
        (
            10**9 * (number + 1),
            GRID_TOPIC,
            grid_message(
                ros,
                stair_heights(0.04, seed=number),
                0.04,
                10**9 * (number + 1),
                middle=(0.6 * number, 0.0),
                **options,
            ),
        )
        for number in range(num)
    ]
    return write_bag(folder, kind, ros, messages)


def test_a_single_map_is_a_finished_one(tmp_path: Path) -> None:
    bag = bag_of(tmp_path, num=1)
    assert has_only_sweeps(bag)
    outcome = stairmap("run", bag, "-o", tmp_path / "run", "--json", "--no-report")
    assert outcome.code == 0, outcome.stderr
    values = json.loads(outcome.stdout)
    ((flight,),) = (stairway["flights"] for stairway in values["stairways"])
    assert flight["rise"] == pytest.approx(0.17, abs=0.003)
    assert flight["run"] == pytest.approx(0.28, abs=0.003)
    # Six risers that stand anywhere in cells of 40 mm.
    assert flight["std"]["run"] > 0.0027
    assert flight["num_risers"] == 6
    np.testing.assert_allclose(flight["base"], [1.5 - 2.25, 0.0, 0.0], atol=0.03)
    assert (values["num_sweeps"], values["num_frames"]) == (1, 1)


def test_maps_are_looked_at_as_the_robot_moves(tmp_path: Path) -> None:
    ros = Ros("ros1")
    # The same steps in a map that moves by 0.2 m each time: every third is looked at, and the last.
    messages = []
    for number in range(8):
        shift = 0.2 * number
        heights = np.roll(stair_heights(0.04, seed=number), -round(shift / 0.04), axis=0)
        stamp_ns = 10**9 * (number + 1)
        message = grid_message(ros, heights, 0.04, stamp_ns, middle=(shift, 0.0), start=(3, 5))
        messages.append((stamp_ns, GRID_TOPIC, message))
    bag = write_bag(tmp_path, "ros1", ros, messages)
    outcome = stairmap(
        "run", bag, "--cloud-topic", GRID_TOPIC, "-o", tmp_path / "run", "--json", "--no-report"
    )
    assert outcome.code == 0, outcome.stderr
    values = json.loads(outcome.stdout)
    assert (values["num_sweeps"], values["num_frames"]) == (8, 4)
    (stairway,) = values["stairways"]
    assert stairway["num_observations"] >= 3
    assert stairway["flights"][0]["rise"] == pytest.approx(0.17, abs=0.003)
    np.testing.assert_allclose(stairway["flights"][0]["base"][:2], [-0.75, 0.0], atol=0.04)
    saved = json.loads((tmp_path / "run" / "stairways.json").read_text())
    assert saved["frame_id"] == "odom"


def test_a_level_map_has_no_stairs(tmp_path: Path) -> None:
    ros = Ros("mcap")
    heights = np.random.default_rng(0).normal(0, 0.01, (90, 90))
    bag = write_bag(tmp_path, "mcap", ros, [(1, GRID_TOPIC, grid_message(ros, heights, 0.04, 1))])
    outcome = stairmap("run", bag, "-o", tmp_path / "run", "--no-report")
    assert outcome.code == 0, outcome.stderr
    assert "1 elevation map of /elevation_mapping/elevation_map in 1 window" in outcome.stdout
    assert "no stairway was found" in outcome.stdout


def test_damaged_maps_are_skipped_and_wrong_requests_are_said(tmp_path: Path) -> None:
    bag = bag_of(tmp_path, num=2)
    recording = ElevationRecording(bag, options=BagOptions(cloud_topic=f"{GRID_TOPIC}:slope"))
    with pytest.raises(RecordingError, match=r"none of the 2 elevation maps .* no layer slope"):
        list(recording)
    assert len(recording.problems.skipped) == 2
    with pytest.raises(RecordingError, match=r"leave --up out"):
        ElevationRecording(bag, up="+y")
    outcome = stairmap("run", bag, "--map-frame", "odom", "-o", tmp_path / "run")
    assert outcome.code == 1
    assert "an elevation map says itself where it lies" in outcome.stderr
