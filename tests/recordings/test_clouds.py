"""Files of points of every format, whole and broken."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cloud_files import (
    POINTS,
    write_ascii_pcd,
    write_ascii_ply,
    write_binary_pcd,
    write_binary_ply,
    write_compressed_pcd,
    write_las,
    write_xyz,
)
from e57_files import SCAN, e57_content, paged, posed, write_e57
from stairmap.errors import RecordingError
from stairmap.recordings.clouds.foreign_errors import refused_as
from stairmap.recordings.clouds.lzf import decompress_lzf
from stairmap.recordings.clouds.open import open_cloud
from stairmap.recordings.clouds.sampling import sample_points

FAR = np.array([691_000.0, 5_335_000.0, 512.0])
"""Where a national grid puts a town, m."""

WRITERS = {
    "ascii.pcd": write_ascii_pcd,
    "binary.pcd": write_binary_pcd,
    "compressed.pcd": write_compressed_pcd,
    "ascii.ply": write_ascii_ply,
    "little.ply": lambda path, points: write_binary_ply(path, points, order="<"),
    "big.ply": lambda path, points: write_binary_ply(path, points, order=">"),
    "map.las": write_las,
    "map.laz": write_las,
    "map.xyz": write_xyz,
    "map.e57": write_e57,
}


@pytest.mark.parametrize("name", WRITERS)
def test_points_come_back_as_they_were_written(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    WRITERS[name](path, POINTS)

    cloud = open_cloud(path)
    read = np.concatenate(list(cloud.chunks()))

    assert read == pytest.approx(POINTS, abs=1e-3)
    assert read.dtype == np.float64
    assert cloud.num_points in (None, len(POINTS))


@pytest.mark.parametrize("name", ["ascii.ply", "map.las", "map.xyz", "map.e57"])
def test_places_on_national_grids_keep_their_millimetres(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    WRITERS[name](path, POINTS + FAR)

    read = np.concatenate(list(open_cloud(path).chunks()))

    assert read - FAR == pytest.approx(POINTS, abs=1e-3)


@pytest.mark.parametrize("name", WRITERS)
def test_a_sample_holds_points_of_the_file(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    WRITERS[name](path, POINTS)

    sample = sample_points(open_cloud(path))

    assert len(sample) >= len(POINTS)
    assert sample.min(axis=0) == pytest.approx(POINTS.min(axis=0), abs=1e-3)
    assert sample.max(axis=0) == pytest.approx(POINTS.max(axis=0), abs=1e-3)


def test_points_that_were_not_measured_are_nan(tmp_path: Path) -> None:
    points = POINTS.copy()
    points[3] = np.nan
    write_ascii_pcd(tmp_path / "map.pcd", points)

    read = np.concatenate(list(open_cloud(tmp_path / "map.pcd").chunks()))

    assert np.isnan(read[3]).all()
    assert np.isfinite(read[4:]).all()


def test_what_a_file_begins_with_counts_more_than_its_ending(tmp_path: Path) -> None:
    write_binary_ply(tmp_path / "map.xyz", POINTS, order="<")

    assert open_cloud(tmp_path / "map.xyz").kind == "PLY, binary"


def test_names_and_comments_before_text_are_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "map.csv"
    path.write_text("// scan of a hall\nx,y,z,intensity\n1.5,2.5,3.5,9\n-1,0,1e1,8\n")

    (read,) = open_cloud(path).chunks()

    assert read.tolist() == [[1.5, 2.5, 3.5], [-1.0, 0.0, 10.0]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1 2 3\n4 five 6\n", "expected 3 numbers in each line of map.xyz, but line 2 of the points is"),
        ("1 2 3\n4 5\n", "expected 3 numbers in each line of map.xyz, but line 2 of the points is"),
        ("red green blue\n", "expected lines of x y z in map.xyz, got 'red green blue'"),
        ("1 2\n3 4\n", "expected lines of x y z in map.xyz"),
    ],
)
def test_text_that_is_no_points_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("map.xyz").write_text(text)

    with pytest.raises(RecordingError, match=message):
        list(open_cloud(Path("map.xyz")).chunks())


@pytest.mark.parametrize("name", [name for name in WRITERS if name != "map.xyz"])
def test_a_file_that_was_cut_off_is_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    WRITERS[name](path, POINTS)
    path.write_bytes(path.read_bytes()[:-200])

    with pytest.raises(RecordingError) as caught:
        list(open_cloud(path).chunks())

    assert "\n" not in str(caught.value)
    assert name in str(caught.value)


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("length", [0, 3, 20, 150])
def test_a_file_of_a_few_bytes_is_refused_or_holds_what_it_holds(
    tmp_path: Path, name: str, length: int
) -> None:
    path = tmp_path / name
    WRITERS[name](path, POINTS)
    path.write_bytes(path.read_bytes()[:length])

    try:
        list(open_cloud(path).chunks())
    except RecordingError as error:
        assert "\n" not in str(error)
    else:
        assert name == "map.xyz"


def test_colours_without_coordinates_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.ply"
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty uchar red\nproperty uchar green\nend_header\n1 2\n"
    )

    with pytest.raises(
        RecordingError, match=r"expected vertices with x, y and z in .*, but they have 'red green'"
    ):
        open_cloud(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("POINTS 40", "POINTS 41", "says 41 points, but 40 x 1 in width and height"),
        ("WIDTH 40\nHEIGHT 1\nPOINTS 40", "WIDTH 9000\nHEIGHT 1\nPOINTS 9000", "has room for 40"),
        ("FIELDS x y z", "FIELDS r g b", "expected fields x, y and z in .*, but it has 'r g b'"),
        ("SIZE 4 4 4", "SIZE 4 4", "names 3 fields, but 2 sizes"),
        ("TYPE F F F", "TYPE F F Q", "has the unknown type 'Q 4 x 1'"),
        (
            "DATA binary",
            "DATA folded",
            "expected DATA ascii, binary or binary_compressed in .*, got 'folded'",
        ),
        ("WIDTH 40", "WIDTH forty", "expected whole numbers after WIDTH in .*, got 'forty'"),
    ],
)
def test_a_pcd_header_that_cannot_be_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "map.pcd"
    write_binary_pcd(path, POINTS)
    path.write_bytes(path.read_bytes().replace(old.encode(), new.encode()))

    with pytest.raises(RecordingError, match=message):
        open_cloud(path)


def test_another_kind_of_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.docx").write_bytes(b"PK\x03\x04 and more")

    with pytest.raises(RecordingError, match=r"expected a file of points \(.pcd, .*\), but .* is not one"):
        open_cloud(tmp_path / "notes.docx")


def test_lzf_repeats_what_it_refers_to() -> None:
    # Three bytes as they are, then seven from three back: the reference reaches into what it writes.
    assert decompress_lzf(bytes([2, 65, 66, 67, (5 << 5) | 0, 2]), 10) == b"ABCABCABCA"


@pytest.mark.parametrize(
    ("packed", "message"),
    [
        (bytes([9, 65]), "within a run"),
        (bytes([0, 65, 0x20]), "within a reference"),
        (bytes([0, 65, 0x20, 9]), "before its beginning"),
        (bytes([0, 65]), "expected 3 bytes, got 1"),
    ],
)
def test_broken_lzf_is_refused(packed: bytes, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        decompress_lzf(packed, 3)


def test_scans_of_an_e57_file_are_placed_by_their_poses(tmp_path: Path) -> None:
    # One stands a metre up and is turned by a quarter about z; the other has no pose.
    write_e57(tmp_path / "map.e57", POINTS, scans=SCAN + posed(SCAN))

    read = np.concatenate(list(open_cloud(tmp_path / "map.e57").chunks()))

    assert read[: len(POINTS)] == pytest.approx(POINTS)
    turned = np.stack([-POINTS[:, 1], POINTS[:, 0], POINTS[:, 2] + 1.0], axis=1)
    assert read[len(POINTS) :] == pytest.approx(turned)


def test_e57_file_of_images_alone_is_told_so(tmp_path: Path) -> None:
    write_e57(tmp_path / "map.e57", POINTS, scans="")
    with pytest.raises(RecordingError, match=r"expected scans in .* but it holds none"):
        list(open_cloud(tmp_path / "map.e57").chunks())


def test_panic_of_a_package_is_a_message(tmp_path: Path) -> None:
    # The section of points does not begin with 1: its library panics, which is no Exception in Python.
    content = bytearray(e57_content(POINTS))
    content[48] = 7
    (tmp_path / "map.e57").write_bytes(paged(bytes(content)))
    with pytest.raises(RecordingError, match=r"cannot read .* as E57: .*Section ID"):
        list(open_cloud(tmp_path / "map.e57").chunks())


def test_wish_to_end_is_no_error_of_a_file() -> None:
    for wish in (KeyboardInterrupt, SystemExit):
        with pytest.raises(wish), refused_as("cannot read it"):
            raise wish
    with pytest.raises(RecordingError, match=r"^cannot read it: TypeError$"), refused_as("cannot read it"):
        raise TypeError
