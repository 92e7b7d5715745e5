from __future__ import annotations

from pathlib import Path

import pytest

from stairmap.batch.inputs import find_inputs, is_cloud
from stairmap.errors import BatchError


def touch(*paths: Path) -> None:
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"x")


def names(found, root):
    return [str(Path(item).relative_to(root)) for item in found]


def test_folder_gives_every_recording_in_it_in_the_order_of_names(tmp_path):
    touch(
        tmp_path / "b" / "hall" / "depth.txt",
        tmp_path / "b" / "hall" / "depth" / "0.png",
        tmp_path / "a" / "one.mcap",
        tmp_path / "a" / "two.bag",
        tmp_path / "a" / "notes.txt",
        tmp_path / "c" / "rosbag" / "metadata.yaml",
        tmp_path / "c" / "rosbag" / "rosbag_0.db3",
        tmp_path / "c" / "map.laz",
        tmp_path / ".hidden" / "three.bag",
    )
    assert names(find_inputs([str(tmp_path)]), tmp_path) == [
        "a/one.mcap", "a/two.bag", "b/hall", "c/map.laz", "c/rosbag",
    ]  # fmt: skip


def test_globs_lists_and_paths_give_each_recording_once(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    touch(tmp_path / "m1.mcap", tmp_path / "m2.mcap", tmp_path / "other.bag")
    (tmp_path / "list.txt").write_text("# Monday\nother.bag\n\nm1.mcap\nlost.bag\n")
    found = find_inputs(["m*.mcap", "@list.txt", "m2.mcap"])
    assert names(found, tmp_path) == ["m1.mcap", "m2.mcap", "other.bag", "lost.bag"]


def test_what_is_not_there_is_kept_to_become_a_row(tmp_path):
    (tmp_path / "empty").mkdir()
    found = find_inputs([str(tmp_path / "none"), str(tmp_path / "*.bag"), str(tmp_path / "empty")])
    assert names(found, tmp_path) == ["none", "*.bag", "empty"]


def test_file_with_the_marks_of_a_glob_in_its_name_is_that_file(tmp_path):
    touch(tmp_path / "run[1].bag", tmp_path / "run1.bag")
    assert names(find_inputs([str(tmp_path / "run[1].bag")]), tmp_path) == ["run[1].bag"]


def test_list_that_is_not_there_is_told(tmp_path):
    with pytest.raises(BatchError, match=r"cannot read .*none\.txt"):
        find_inputs([f"@{tmp_path / 'none.txt'}"])


def test_list_in_a_list_and_empty_list_are_refused(tmp_path):
    (tmp_path / "outer.txt").write_text("@inner.txt\n")
    (tmp_path / "empty.txt").write_text("# nothing\n")
    with pytest.raises(BatchError, match="named in a list"):
        find_inputs([f"@{tmp_path / 'outer.txt'}"])
    with pytest.raises(BatchError, match="name none"):
        find_inputs([f"@{tmp_path / 'empty.txt'}"])


def test_addresses_are_searched_like_folders(tmp_path):
    touch(tmp_path / "day" / "hall" / "depth.txt", tmp_path / "day" / "hall" / "depth" / "a.bag")
    touch(tmp_path / "day" / "x.mcap")
    root = f"file://{tmp_path}"
    assert sorted(find_inputs([f"{root}/day"])) == [f"{root}/day/hall", f"{root}/day/x.mcap"]
    assert find_inputs([f"{root}/day/*.mcap"]) == (f"{root}/day/x.mcap",)
    assert find_inputs([f"{root}/none"]) == (f"{root}/none",)


def test_address_without_a_package_is_told(tmp_path):
    with pytest.raises(BatchError, match="cannot reach nothing://"):
        find_inputs(["nothing://bucket/x"])


@pytest.mark.parametrize("name", ["a.pcd", "b.PLY", "s3://x/c.laz", "d.e57"])
def test_clouds_are_told_by_their_ending(name):
    assert is_cloud(name)
    assert not is_cloud(name.rpartition(".")[0] + ".bag")
