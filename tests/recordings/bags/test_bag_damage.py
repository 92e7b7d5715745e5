"""A bag that is cut off, not closed or corrupt gives all that can be read of it, and says so."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from bag_files import Ros, robot_messages, write_bag
from small_recordings import repeat_frames, write_recording
from stairmap.errors import RecordingError, StairmapError
from stairmap.recordings.image_folder import ImageFolderRecording
from stairmap.recordings.open import open_recording

NUM_FRAMES = 30
KINDS = ("ros1", "ros1_lz4", "bare_mcap", "mcap_zstd", "bare_db3", "sqlite")


@pytest.fixture(scope="module")
def long_walk(tmp_path_factory: pytest.TempPathFactory) -> ImageFolderRecording:
    folder = write_recording(tmp_path_factory.mktemp("images") / "walk", num_frames=4)
    repeat_frames(folder, NUM_FRAMES)
    return ImageFolderRecording(folder)


def written(folder: Path, kind: str, walk: ImageFolderRecording) -> tuple[Path, Path]:
    """Path of a bag, and of the file in it with the messages."""
    ros = Ros(kind)
    path = write_bag(folder, kind, ros, robot_messages(ros, walk))
    if path.is_file():
        return path, path
    (file,) = (file for file in path.iterdir() if file.name != "metadata.yaml")
    return path, file


def keep_share(file: Path, share: float) -> None:
    data = file.read_bytes()
    file.write_bytes(data[: int(len(data) * share)])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("share", [0.99, 0.5])
def test_cut_off_bag_gives_what_came_before_the_cut(
    tmp_path: Path, kind: str, share: float, long_walk: ImageFolderRecording
) -> None:
    path, file = written(tmp_path, kind, long_walk)
    keep_share(file, share)
    recording = open_recording(path)
    # The last block that was being written is lost: up to a megabyte, which is seven of these frames.
    num_expected = int(NUM_FRAMES * share)
    assert num_expected - 8 <= recording.num_frames <= num_expected + 1
    assert sum(1 for _ in recording) == recording.num_frames - len(recording.problems.skipped)
    assert recording.problems.num_frames_without_pose <= 1
    assert len(recording.problems.skipped) <= 1
    if recording.num_frames == NUM_FRAMES:
        return  # only the index was cut off
    (note,) = (line for line in recording.problems.to_lines() if "cut off" in line)
    assert note.startswith(file.name)
    assert note.endswith("all that can be read is used")


def test_bag_that_its_recorder_did_not_close_is_read_whole(
    tmp_path: Path, long_walk: ImageFolderRecording
) -> None:
    """What ``rosbag record`` leaves as ``.bag.active`` when it is killed: nothing after the last chunk."""
    path, _ = written(tmp_path, "ros1", long_walk)
    data = bytearray(path.read_bytes())
    at = data.index(b"index_pos=") + len(b"index_pos=")
    index_pos = int.from_bytes(data[at : at + 8], "little")
    data[at : at + 8] = bytes(8)
    active = tmp_path / "walk.bag.active"
    active.write_bytes(data[:index_pos])
    recording = open_recording(active)
    assert recording.name == "walk"
    assert sum(1 for _ in recording) == NUM_FRAMES
    assert "was not closed by its recorder" in recording.problems.notes[0]


@pytest.mark.parametrize("kind", ["ros1_lz4", "mcap_zstd"])
def test_corrupt_block_costs_only_its_own_frames(
    tmp_path: Path, kind: str, long_walk: ImageFolderRecording
) -> None:
    path, file = written(tmp_path, kind, long_walk)
    data = bytearray(file.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 64] = bytes(64)
    file.write_bytes(data)
    recording = open_recording(path)
    num_read = sum(1 for _ in recording)
    assert NUM_FRAMES - 10 <= num_read < NUM_FRAMES
    assert "has a chunk that is corrupt" in recording.problems.notes[0]


def test_mcap_of_another_writer_without_profile_is_read_and_not_called_damaged(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    path, _ = written(tmp_path, "bare_mcap", walk)
    data = path.read_bytes()
    header = b"\x04\0\0\0ros2"
    at = data.index(header)
    # Of the same length, so that all offsets stay right.
    path.write_bytes(data[:at] + b"\x04\0\0\0none" + data[at + len(header) :])
    recording = open_recording(path)
    assert sum(1 for _ in recording) == 4
    assert recording.problems.to_lines() == ()


def test_messages_that_a_crashed_recorder_left_in_the_log_of_sqlite_are_read(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    path, _ = written(tmp_path, "bare_db3", walk)
    database = sqlite3.connect(path)
    rows = database.execute("SELECT * FROM messages ORDER BY id").fetchall()
    database.execute("DELETE FROM messages WHERE id > ?", (len(rows) // 2,))
    database.commit()
    database.execute("PRAGMA journal_mode=WAL")
    database.execute("PRAGMA wal_autocheckpoint=0")
    database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows[len(rows) // 2 :])
    database.commit()
    copied = tmp_path / "crashed.db3"
    for end in ("", "-wal"):
        copied.with_name(copied.name + end).write_bytes(path.with_name(path.name + end).read_bytes())
    database.close()
    recording = open_recording(copied)
    assert sum(1 for _ in recording) == 4


def test_bag_cut_off_before_its_first_message_is_refused(tmp_path: Path, walk: ImageFolderRecording) -> None:
    for kind in ("ros1", "bare_mcap"):
        path, _ = written(tmp_path, kind, walk)
        path.write_bytes(path.read_bytes()[:60])
        with pytest.raises(RecordingError, match=r"expected messages in .*, but it has none: .* is cut off"):
            open_recording(path)
        path.unlink()


@pytest.mark.parametrize("kind", ["ros1", "bare_mcap", "mcap_zstd", "bare_db3"])
@pytest.mark.parametrize("seed", range(12))
def test_whatever_happens_to_the_bytes_there_are_frames_or_one_line(
    tmp_path: Path, kind: str, seed: int, walk: ImageFolderRecording
) -> None:
    path, file = written(tmp_path, kind, walk)
    random = np.random.default_rng(seed)
    data = bytearray(file.read_bytes())
    place = int(random.integers(len(data)))
    if seed % 3 == 0:
        del data[place:]
    elif seed % 3 == 1:
        del data[place : place + 3000]
    else:
        for place in random.integers(min(5000, len(data)), size=8):
            data[place] = int(random.integers(256))
    file.write_bytes(data)
    try:
        recording = open_recording(path)
        assert sum(1 for _ in recording) <= 4
        assert all("\n" not in line for line in recording.problems.to_lines())
    except StairmapError as error:
        assert "\n" not in str(error)


def test_metadata_that_names_a_file_that_is_not_there_costs_nothing_else(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    path, file = written(tmp_path, "sqlite", walk)
    metadata = path / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace(file.name, "walk_7.db3"))
    recording = open_recording(path)
    assert sum(1 for _ in recording) == 4
    assert recording.problems.notes[0].startswith(
        "metadata.yaml does not fit the files, which are read without"
    )


def test_file_of_a_bag_with_compressed_messages_is_read_without_its_folder(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    path, file = written(tmp_path, "sqlite_zstd_messages", walk)
    (path / "metadata.yaml").unlink()
    for name in (path, file):
        recording = open_recording(name)
        assert sum(1 for _ in recording) == 4
        assert recording.problems.to_lines() == ()


def test_opening_tells_how_far_it_is(tmp_path: Path, long_walk: ImageFolderRecording) -> None:
    path, _ = written(tmp_path, "bare_mcap", long_walk)
    told: list[tuple[int, int]] = []
    open_recording(path, watch=lambda count, total: told.append((count, total)))
    # Depth, two transforms a frame, and the static ones.
    assert told == [(0, 3 * NUM_FRAMES + 1)]


def test_files_of_a_cut_off_bag_are_read_as_they_were_counted(
    tmp_path: Path, long_walk: ImageFolderRecording
) -> None:
    """The tenth file of a recorder that splits comes after the second, whatever the alphabet says."""
    ros = Ros("bare_mcap")
    messages = sorted(robot_messages(ros, long_walk), key=lambda message: message[0])
    half = len(messages) // 2
    bag = tmp_path / "bag"
    bag.mkdir()
    for number, part in ((2, messages[:half]), (10, messages[half:])):
        (tmp_path / f"part_{number}").mkdir()
        write_bag(tmp_path / f"part_{number}", "bare_mcap", ros, part).rename(bag / f"walk_{number}.mcap")
    keep_share(bag / "walk_10.mcap", 0.9)
    recording = open_recording(bag)
    assert recording.num_frames > 0.8 * NUM_FRAMES
    assert not any("set back" in note for note in recording.problems.notes)


def test_a_database_of_something_else_is_called_no_bag(tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / "contacts.db3")) as database:
        database.execute("CREATE TABLE contacts (name TEXT)")
        database.commit()
    with pytest.raises(RecordingError, match=r"contacts\.db3 is no bag \(no such table: topics\)"):
        open_recording(tmp_path / "contacts.db3")
