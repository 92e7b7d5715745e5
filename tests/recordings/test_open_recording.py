"""Whatever path a user gives: a recording, or one line that says what was expected."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from stairmap.errors import RecordingError, StairmapError
from stairmap.recordings.open import open_recording


def _refusal(path: Path) -> str:
    with pytest.raises(RecordingError) as caught:
        open_recording(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_an_image_folder_is_opened(make_recording: Callable[..., Path], tmp_path: Path) -> None:
    folder = make_recording()
    assert len(list(open_recording(folder))) == 4
    assert len(list(open_recording(str(folder)))) == 4  # type: ignore[arg-type]
    other = tmp_path / "other.tum"
    other.write_text("100 0 0 5 0 0 0 1\n")
    recording = open_recording(folder, trajectory=other, up="-y")
    assert recording.check_poses().map_from_camera[0, :3, 3].tolist() == [0, 5, 0]


def test_a_path_that_is_not_there_is_told(tmp_path: Path) -> None:
    assert _refusal(tmp_path / "walk").startswith("expected a recording, but there is no ")


def test_files_of_points_and_other_formats_are_named(tmp_path: Path) -> None:
    for name, expected in (
        ("walk.ply", "may hold points; stairmap scan finds stairs in those"),
        ("walk.las", "may hold points; stairmap scan finds stairs in those"),
        ("walk.svo", "ZED recordings are not supported yet; expected a bag (.bag, .mcap, .db3), or a folder"),
    ):
        (tmp_path / name).write_bytes(b"data")
        assert expected in _refusal(tmp_path / name)


@pytest.mark.parametrize("name", ["walk.bag", "walk.mcap", "walk.db3"])
def test_file_that_is_no_bag_despite_its_name_is_told_by_its_beginning(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"data")
    assert f"{name} is no bag: it begins with b'data'; expected one of ROS 1" in _refusal(tmp_path / name)
    (tmp_path / name).write_bytes(b"")
    assert f"{name} is empty; expected a bag" in _refusal(tmp_path / name)
    (tmp_path / name).write_bytes(bytes(1000))
    assert "it begins with only zeros" in _refusal(tmp_path / name)


def test_folder_whose_bag_is_no_bag_is_told(tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information:")
    (tmp_path / "walk_0.mcap").write_bytes(b"data")
    assert f"expected the files of a bag in {tmp_path}, but it has none" in _refusal(tmp_path)


def test_a_file_of_a_recording_leads_to_its_folder(make_recording: Callable[..., Path]) -> None:
    folder = make_recording()
    assert _refusal(folder / "depth.txt").endswith(f"is a file; pass {folder}")


def test_any_other_file_is_told(tmp_path: Path) -> None:
    (tmp_path / "photo.png").write_bytes(b"data")
    assert _refusal(tmp_path / "photo.png").endswith("photo.png is a file")


def test_a_folder_around_a_recording_leads_to_it(make_recording: Callable[..., Path]) -> None:
    folder = make_recording()
    assert _refusal(folder.parent).endswith(f"pass {folder}")


def test_a_folder_of_images_without_a_list_is_told_how(make_recording: Callable[..., Path]) -> None:
    folder = make_recording()
    (folder / "depth.txt").unlink()
    message = _refusal(folder)
    assert (
        "holds only camera.json, depth, groundtruth.txt; list the images in depth.txt: stamp_s filename"
        in message
    )


def test_an_empty_folder_is_told(tmp_path: Path) -> None:
    assert "is empty" in _refusal(tmp_path)


def test_errors_of_the_parts_come_through(make_recording: Callable[..., Path]) -> None:
    folder = make_recording()
    (folder / "camera.json").write_text("{")
    with pytest.raises(StairmapError, match=r"camera.json:1: expected JSON"):
        open_recording(folder)
