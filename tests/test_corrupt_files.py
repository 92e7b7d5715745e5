"""Files that a disk, a cable or an editor has spoilt: never a traceback, never more than a line."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bag_files import Ros, robot_messages, write_bag
from command_line import stairmap
from small_recordings import write_recording
from stairmap.cli.exits import FAULT
from stairmap.recordings.image_folder import ImageFolderRecording
from test_bad_inputs import MAP, ROBOT, limits

NUM_NIGHTLY = 2_000
"""Corruptions of each kind of file in the nightly target."""

NUM_QUICK = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """A kind of file: where it is, and what reads it."""

    path: str
    arguments: tuple[str, ...]


KINDS = {
    "stairways.json": Kind(path="run/stairways.json", arguments=("check", "run", "--robot", "spot")),
    "detections.jsonl": Kind(
        path="run/detections.jsonl", arguments=("view", "run", "--page", "out/page.html")
    ),
    "history.jsonl": Kind(path="killed/history.jsonl", arguments=("check", "killed", "--robot", "spot")),
    "trajectory.tum": Kind(
        path="run/trajectory.tum", arguments=("export", "run", "-f", "nav2-graph", "-o", "out")
    ),
    "recording.json": Kind(path="run/recording.json", arguments=("view", "run", "--page", "out/page.html")),
    "camera.json": Kind(path="stairs/camera.json", arguments=("inspect", "stairs")),
    "depth.txt": Kind(path="stairs/depth.txt", arguments=("inspect", "stairs")),
    "groundtruth.txt": Kind(path="stairs/groundtruth.txt", arguments=("inspect", "stairs")),
    "depth image": Kind(path="stairs/depth/000001.png", arguments=("inspect", "stairs")),
    "bag of ROS 1": Kind(path="walk.bag", arguments=("inspect", "walk.bag")),
    "MCAP": Kind(path="walk.mcap", arguments=("inspect", "walk.mcap")),
    "SQLite": Kind(path="walk.db3", arguments=("inspect", "walk.db3")),
    "robot profile": Kind(path="bot.yaml", arguments=("check", "run", "--robot", "bot.yaml")),
    "config": Kind(path="config.yaml", arguments=("config", "--config", "config.yaml")),
    "map": Kind(path="0.yaml", arguments=("plan", "run", "--map", "0=0.yaml")),
    "map image": Kind(path="0.pgm", arguments=("plan", "run", "--map", "0=0.yaml")),
}


BAGS = {"ros1": "walk.bag", "bare_mcap": "walk.mcap", "bare_db3": "walk.db3"}


@pytest.fixture(scope="module")
def folder(run_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("corrupt")
    shutil.copytree(run_folder, folder / "run")
    shutil.copytree(run_folder, folder / "killed")
    (folder / "killed" / "stairways.json").unlink()
    write_recording(folder / "stairs", num_frames=3)
    for kind, target in BAGS.items():
        ros = Ros(kind)
        messages = robot_messages(ros, ImageFolderRecording(folder / "stairs"))
        (folder / "bags").mkdir(exist_ok=True)
        written = write_bag(folder / "bags", kind, ros, messages)
        file = (
            written
            if written.is_file()
            else next(path for path in written.iterdir() if path.suffix != ".yaml")
        )
        shutil.move(file, folder / target)
        shutil.rmtree(folder / "bags")
    (folder / "bot.yaml").write_text(yaml.safe_dump(ROBOT))
    (folder / "config.yaml").write_text(stairmap("config").stdout)
    (folder / "0.yaml").write_text(yaml.safe_dump(MAP))
    (folder / "0.pgm").write_bytes(b"P5\n8 8\n255\n" + bytes([254] * 64))
    return folder


def flip_bits(content: bytes, places: list[float], bits: list[int]) -> bytes:
    spoilt = bytearray(content)
    for place, bit in zip(places, bits, strict=True):
        spoilt[int(place * len(spoilt))] ^= 1 << bit
    return bytes(spoilt)


def swap_fields(content: bytes, first: float, second: float) -> bytes:
    """Exchange two pieces between separators: values come under another's key."""
    separators = b" ,:\n[]{}"
    pieces, start = [], 0
    for index, byte in enumerate(content):
        if byte in separators:
            pieces += [content[start:index], content[index : index + 1]]
            start = index + 1
    pieces.append(content[start:])
    fields = [index for index in range(0, len(pieces), 2) if pieces[index]]
    one, other = (fields[int(place * len(fields))] for place in (first, second))
    pieces[one], pieces[other] = pieces[other], pieces[one]
    return b"".join(pieces)


places = st.floats(0, 1, exclude_max=True)


@st.composite
def corruptions(draw: st.DrawFn) -> Callable[[bytes], bytes]:
    way = draw(st.sampled_from(["flip", "cut", "swap", "zeros", "twice"]))
    first, second = draw(places), draw(places)
    if way == "flip":
        number = draw(st.integers(1, 8))
        where = draw(st.lists(places, min_size=number, max_size=number))
        bits = draw(st.lists(st.integers(0, 7), min_size=number, max_size=number))
        return lambda content: flip_bits(content, where, bits)
    if way == "cut":
        return lambda content: content[: int(first * len(content))]
    if way == "zeros":
        return lambda content: content[: int(first * len(content))].ljust(len(content), b"\0")
    if way == "twice":
        return lambda content: content + content[int(first * len(content)) :]
    return lambda content: swap_fields(content, first, second)


def check_corrupted(kind: Kind, folder: Path, corrupt: Callable[[bytes], bytes]) -> None:
    path = folder / kind.path
    original = path.read_bytes()
    try:
        path.write_bytes(corrupt(original))
        with limits():
            outcome = stairmap(*kind.arguments)
    finally:
        path.write_bytes(original)
        shutil.rmtree(folder / "out", ignore_errors=True)
    text = outcome.stdout + outcome.stderr
    assert FAULT not in text and "Traceback" not in text and "not enough memory" not in text, text
    assert outcome.code in (0, 1)
    if outcome.code == 1:
        assert outcome.stderr.count("error: ") == 1 and outcome.stderr.endswith("\n")


@pytest.mark.parametrize("name", KINDS)
def test_corrupt_file_is_told_or_read(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_often(name, folder, monkeypatch, NUM_QUICK)


@pytest.mark.nightly
@pytest.mark.parametrize("name", KINDS)
def test_corrupt_file_is_told_or_read_two_thousand_times(
    name: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    check_often(name, folder, monkeypatch, NUM_NIGHTLY)


def check_often(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    monkeypatch.chdir(folder)

    @settings(max_examples=number, deadline=None, suppress_health_check=list(HealthCheck), database=None)
    @given(corruptions())
    def check(corrupt: Callable[[bytes], bytes]) -> None:
        check_corrupted(KINDS[name], folder, corrupt)

    check()
