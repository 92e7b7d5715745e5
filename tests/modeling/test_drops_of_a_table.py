"""A camera held over the table of a real kitchen, whose edges are no edges of the ground."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from command_line import stairmap

pytestmark = pytest.mark.nightly


def drops_by_frame(folder: Path) -> list[list[dict[str, object]]]:
    lines = (folder / "detections.jsonl").read_text(encoding="utf-8").splitlines()
    return [json.loads(line)["drops"] for line in lines]


def test_the_map_has_no_edge_of_a_table_that_single_frames_take_for_ground(
    shared_data: Path, tmp_path: Path
) -> None:
    kitchen = shared_data / "real" / "no_stairs_kitchen_kinect_v1"
    assert stairmap("run", kitchen, "--up=auto", "-o", tmp_path / "run").code == 0
    values = json.loads((tmp_path / "run" / "stairways.json").read_text(encoding="utf-8"))
    assert values["drops"] == []
    # Two thirds of the frames see nothing but the table, 0.5 to 0.9 m below the camera.
    assert 50 < sum(map(bool, drops_by_frame(tmp_path / "run"))) < 75
    options = ("--no-overlays", "--set", "detection.camera_height=1.5")
    assert stairmap("detect", kitchen, "--up=auto", "-o", tmp_path / "high", *options).code == 0
    assert not any(drops_by_frame(tmp_path / "high"))
