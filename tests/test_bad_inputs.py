"""Bad inputs of every kind: the exit code, one line that names the mistake, no traceback, no hang."""

from __future__ import annotations

import copy
import json
import os
import resource
import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml

from command_line import Outcome, stairmap
from documented_messages import DOCUMENTED
from small_recordings import write_recording
from stairmap.cli.exits import FAULT

TIME_LIMIT = 10
"""Seconds of processor time after which a command takes too long: what else runs does not count."""

HANG_LIMIT = 120
"""Seconds after which a command hangs, that waits without working."""

MEMORY_LIMIT = 2 * 2**30
"""Bytes that a bad input may ask for."""


class TimeLimitReached(BaseException):
    """A command took too long; none of its handlers of errors can take this for one of its own."""


@contextmanager
def limits() -> Iterator[None]:
    """Let a command have 10 s of processor time and 2 GB and no more."""
    used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    before = resource.getrlimit(resource.RLIMIT_AS)

    def give_up(*_: object) -> None:
        raise TimeLimitReached

    handlers = {number: signal.signal(number, give_up) for number in (signal.SIGALRM, signal.SIGPROF)}
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY_LIMIT, before[1]))
    signal.alarm(HANG_LIMIT)
    signal.setitimer(signal.ITIMER_PROF, TIME_LIMIT)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.setitimer(signal.ITIMER_PROF, 0)
        for number, handler in handlers.items():
            signal.signal(number, handler)
        resource.setrlimit(resource.RLIMIT_AS, before)


def run_limited(*arguments: str | Path) -> Outcome:
    with limits():
        return stairmap(*arguments)


def check_one_line(outcome: Outcome, *words: str) -> None:
    assert outcome.code == 1, outcome
    assert outcome.stderr.count("\n") == 1, outcome.stderr
    assert outcome.stderr.startswith("error: ")
    assert len(outcome.stderr) < 700
    assert FAULT not in outcome.stderr and "not enough memory" not in outcome.stderr
    assert "Traceback" not in outcome.stderr + outcome.stdout
    for word in words:
        assert word in outcome.stderr, (word, outcome.stderr)
    assert any(pattern.search(outcome.stderr) for pattern in DOCUMENTED), (
        f"no row of docs/troubleshooting.md for: {outcome.stderr}"
    )


class Mess:
    """A folder with good files, one of which a case spoils.

    Attributes
    ----------
    run, recording
        A run folder, and its recording.
    robot, config, floor
        A robot profile, a config file, and a map with its image.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.run, self.recording = folder / "run", folder / "stairs"
        self.robot, self.config, self.floor = folder / "bot.yaml", folder / "config.yaml", folder / "0.yaml"

    def change(self, path: Path, keys: tuple[str | int, ...], value: Any) -> None:
        """Set, or with ``GONE`` remove, a value in a JSON or YAML file."""
        is_json = path.suffix == ".json"
        values = json.loads(path.read_text()) if is_json else yaml.safe_load(path.read_text())
        place = values
        for key in keys[:-1]:
            place = place[key]
        if value is GONE:
            del place[keys[-1]]
        else:
            place[keys[-1]] = copy.deepcopy(value)
        path.write_text(json.dumps(values) if is_json else yaml.safe_dump(values))


GONE = object()


@pytest.fixture(scope="module")
def originals(run_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("originals")
    shutil.copytree(run_folder, folder / "run")
    write_recording(folder / "stairs", num_frames=3)
    (folder / "bot.yaml").write_text(yaml.safe_dump(ROBOT))
    (folder / "config.yaml").write_text("detection:\n  min_steps: 3\n")
    (folder / "0.yaml").write_text(yaml.safe_dump(MAP))
    (folder / "0.pgm").write_bytes(b"P5\n8 8\n255\n" + bytes([254] * 64))
    return folder


@pytest.fixture
def mess(originals: Path, tmp_path: Path) -> Mess:
    shutil.copytree(originals, tmp_path / "mess")
    return Mess(tmp_path / "mess")


ROBOT = {
    "name": "bot", "max_continuous_rise": 0.2, "max_single_rise": 0.3,
    "min_run": {"value": 0.2, "source": "x"}, "max_pitch_deg": 40, "max_slope_deg": 30, "body_width": 0.5,
    "side_clearance": 0.05, "min_landing_length": 1.0,
}  # fmt: skip
MAP = {
    "image": "0.pgm", "resolution": 0.05, "origin": [0, 0, 0], "negate": 0, "occupied_thresh": 0.65,
    "free_thresh": 0.2,
}  # fmt: skip

STAIRWAY = ("stairways", 0)
FLIGHT = (*STAIRWAY, "flights", 0)
STAIRWAYS_CASES: list[tuple[tuple[str | int, ...], Any, str]] = [
    (("schema",), 3, "schema 3"),
    (("schema",), True, "schema true"),
    (("schema",), "2", 'schema "2"'),
    (("schema",), None, "schema null"),
    (("schema",), GONE, "no schema"),
    (("software",), 7, "software"),
    (("frame_id",), None, "frame_id"),
    (("frame_id",), GONE, "lacks the key 'frame_id'"),
    (("num_frames",), -1, "num_frames: should be greater than or equal to 0"),
    (("num_frames",), True, "num_frames: should be a valid integer"),
    (("num_frames",), 1e3, "num_frames"),
    (("stairways",), {}, "stairways: should be a valid list"),
    (("stairways",), None, "stairways"),
    (("stairways",), [1], "stairways.0"),
    ((*STAIRWAY, "id"), 0, "id: should be greater than or equal to 1"),
    ((*STAIRWAY, "id"), -3, "id"),
    ((*STAIRWAY, "id"), True, "id: should be a valid integer"),
    ((*STAIRWAY, "id"), "1", "id"),
    ((*STAIRWAY, "id"), 1.5, "id"),
    ((*STAIRWAY, "id"), 10**30, "id"),
    ((*STAIRWAY, "num_observations"), -1, "num_observations"),
    ((*STAIRWAY, "first_seen_ns"), 2**70, "first_seen_ns"),
    ((*STAIRWAY, "last_seen_ns"), GONE, "last_seen_ns"),
    ((*STAIRWAY, "flights"), [], "flights: list should have at least 1 item"),
    ((*STAIRWAY, "flights"), "none", "flights"),
    ((*STAIRWAY, "landings"), [{}], "landings.0"),
    ((*STAIRWAY, "landings"), [{"center": [0, 0, 0], "size": [1], "heading": 0.0}], "size"),
    ((*STAIRWAY, "landings"), [{"center": [0, 0, 0], "size": [1, -1], "heading": 0.0}], "size.1"),
    ((*STAIRWAY, "landings"), [{"center": [0, 0, 1e9], "size": [1, 1], "heading": 0.0}], "center.2"),
    ((*STAIRWAY, "landings"), GONE, "landings"),
    ((*FLIGHT, "base"), [0, 0], "base: list should have at least 3 items"),
    ((*FLIGHT, "base"), [0, 0, 0, 0], "base: list should have at most 3 items"),
    ((*FLIGHT, "base"), [0, 0, 2e7], "base.2: should be less than or equal to 10000000"),
    ((*FLIGHT, "base"), [0, "0", 0], "base.1: should be a valid number"),
    ((*FLIGHT, "base"), [0, True, 0], "base.1: should be a valid number"),
    ((*FLIGHT, "base"), [0, None, 0], "base.1"),
    ((*FLIGHT, "heading"), 1e6, "heading"),
    ((*FLIGHT, "heading"), "north", "heading"),
    ((*FLIGHT, "rise"), 0.01, "rise: should be greater than or equal to 0.02, got 0.01"),
    ((*FLIGHT, "rise"), 1.01, "rise: should be less than or equal to 1"),
    ((*FLIGHT, "rise"), True, "rise: should be a valid number, got True"),
    ((*FLIGHT, "rise"), "0.17", "rise: should be a valid number"),
    ((*FLIGHT, "rise"), None, "rise"),
    ((*FLIGHT, "rise"), [0.17], "rise"),
    ((*FLIGHT, "rise"), -0.17, "rise"),
    ((*FLIGHT, "rise"), 10**400, "rise"),
    ((*FLIGHT, "run"), 0, "run"),
    ((*FLIGHT, "run"), 300, "run"),
    ((*FLIGHT, "width"), 0, "width"),
    ((*FLIGHT, "width"), 1e300, "width"),
    ((*FLIGHT, "num_risers"), 0, "num_risers"),
    ((*FLIGHT, "num_risers"), 501, "num_risers: should be less than or equal to 500"),
    ((*FLIGHT, "num_risers"), 10**9, "num_risers"),
    ((*FLIGHT, "num_risers"), 8.5, "num_risers"),
    ((*FLIGHT, "num_risers"), True, "num_risers"),
    ((*FLIGHT, "width_bounded"), True, "width_bounded"),
    ((*FLIGHT, "width_bounded", "left"), 1, "width_bounded.left: should be a valid boolean"),
    ((*FLIGHT, "bottom_seen"), "yes", "bottom_seen"),
    ((*FLIGHT, "overhang"), 5.0, "overhang"),
    ((*FLIGHT, "std", "rise"), -0.001, "std.rise: should be greater than or equal to 0"),
    ((*FLIGHT, "std", "base"), [0.1, -0.1, 0.1], "std.base.1"),
    ((*FLIGHT, "std", "base"), [], "std.base"),
    ((*FLIGHT, "std"), GONE, "std"),
    ((*FLIGHT, "std", "width"), GONE, "std.width"),
    ((*FLIGHT, "pitch"), 9, "pitch"),
    ((*FLIGHT, "plane"), [0, 0, 2, 1], "should have a normal [a, b, c] of unit length, has 2"),
    ((*FLIGHT, "plane"), [0, 0, 1], "plane"),
    ((*FLIGHT, "box", "height"), -1, "box.height"),
    ((*FLIGHT, "box"), [], "box"),
    ((*FLIGHT, "steps"), GONE, "steps"),
    ((*FLIGHT, "steps"), [{"nosing": [[0, 0, 0]], "num_observations": 1}], "nosing"),
    ((*FLIGHT, "steps"), [{"nosing": [[0, 0, 0], [0, 0, 2e7]], "num_observations": 1}], "nosing.1.2"),
    ((*FLIGHT, "steps"), [{"nosing": [[0, 0, 0], [0, 0, 0]], "num_observations": -1}], "num_observations"),
]


@pytest.mark.parametrize(("keys", "value", "word"), STAIRWAYS_CASES)
def test_bad_stairways_json(mess: Mess, keys: tuple[str | int, ...], value: Any, word: str) -> None:
    mess.change(mess.run / "stairways.json", keys, value)
    check_one_line(run_limited("check", mess.run, "--robot", "spot"), "stairways.json", word)


STAIRWAYS_TEXTS = {
    "nothing": ("", "line 1"),
    "cut off": ('{"schema": 2, "stairways": [', "not a JSON file"),
    "deep nesting": ("[" * 100_000, "nested deeper than 50 levels"),
    "deep nesting, closed": ("[" * 300 + "]" * 300, "nested deeper than 50 levels"),
    "list": ("[]", "must hold one JSON object"),
    "number": ("3", "must hold one JSON object"),
    "key twice": ('{"schema": 2, "schema": 1}', "the key 'schema' is there twice"),
    "NaN": ('{"schema": 2, "num_frames": NaN}', "NaN is no number of JSON"),
    "Infinity": ('{"schema": 2, "num_frames": -Infinity}', "-Infinity is no number of JSON"),
    "number of 5000 digits": ('{"schema": ' + "9" * 5000 + "}", "not a JSON file"),
    "zeros": ("\0" * 1000, "binary data"),
    "comment": ("# nothing\n", "not a JSON file"),
}


@pytest.mark.parametrize("name", STAIRWAYS_TEXTS)
@pytest.mark.parametrize("command", ["check", "export", "plan", "view"])
def test_stairways_json_that_is_none(mess: Mess, name: str, command: str) -> None:
    text, word = STAIRWAYS_TEXTS[name]
    (mess.run / "stairways.json").write_text(text)
    options = {"export": ("-f", "ply"), "view": ("--page", mess.folder / "p.html")}.get(command, ())
    check_one_line(run_limited(command, mess.run, *options), "stairways.json", word)


def test_two_stairways_with_one_id(mess: Mess) -> None:
    path = mess.run / "stairways.json"
    values = json.loads(path.read_text())
    values["stairways"] *= 2
    path.write_text(json.dumps(values))
    check_one_line(run_limited("check", mess.run), "two have the id 1")


ROBOT_CASES: list[tuple[str, Any, str]] = [
    ("name", 3, "name: should be a valid string"),
    ("name", "", "name: must be a text"),
    ("name", "x" * 101, "at most 100 characters"),
    ("name", GONE, "lacks name"),
    ("min_run", GONE, "lacks min_run"),
    ("min_run", True, "should be a valid number, got True"),
    ("min_run", "0.2", "should be a valid number"),
    ("min_run", -0.2, "should be greater than 0"),
    ("min_run", 200, "is that mm?"),
    ("min_run", [0.2], "should be a valid number"),
    ("min_run", {"value": 0.2, "sauce": "x"}, "{value, source}"),
    ("min_run", {"source": "x"}, "{value, source}"),
    ("max_pitch_deg", 0.6, "degrees"),
    ("max_pitch_deg", 95, "degrees"),
    ("max_continuous_rise", 0.4, "above max_single_rise"),
    ("max_single_rise", float("nan"), "should be a finite number"),
    ("body_width", float("inf"), "should be a finite number"),
    ("body_width", 10**400, "body_width: should be a"),
    ("stair_speed", 1e300, "should be less than or equal to 50"),
    ("stair_speed", 0, "should be greater than 0"),
    ("floor_speed", None, "should be a valid number"),
    ("ascent_risk", -1, "should be greater than or equal to 0"),
    ("descent_risk", 1e9, "should be less than or equal to 1000000"),
    ("wheels", 4, "unknown key wheels"),
    (1, 2, "unknown key 1"),  # type: ignore[list-item]
]


@pytest.mark.parametrize(("key", "value", "word"), ROBOT_CASES)
def test_bad_robot_profile(mess: Mess, key: str, value: Any, word: str) -> None:
    mess.change(mess.robot, (key,), value)
    check_one_line(run_limited("check", mess.run, "--robot", mess.robot), "robot", word)


YAML_TEXTS = {
    "no YAML": ("a: [", "not a YAML file"),
    "tabs": ("a:\n\t- b\n", "not a YAML file"),
    "key twice": ("name: a\nname: b\n", "the key 'name' is there twice"),
    "section twice": ("a: {b: 1}\na: {c: 2}\n", "the key 'a' is there twice"),
    "aliases": ("a: &a [1, 1]\nb: [*a, *a]\n", "aliases"),
    "deep nesting": ("[" * 2000, "not a YAML file"),
    "object": ("!!python/object/apply:os.system ['true']\n", "not a YAML file"),
    "control characters": ("a: \x07\n", "not a YAML file"),
    "list": ("- 1\n- 2\n", "must hold|should be"),
    "text": ("hello\n", "must hold|should be"),
}


@pytest.mark.parametrize("name", YAML_TEXTS)
@pytest.mark.parametrize("kind", ["robot", "config", "floor"])
def test_yaml_that_is_none(mess: Mess, name: str, kind: str) -> None:
    text, words = YAML_TEXTS[name]
    getattr(mess, kind).write_text(text)
    outcome = run_limited(*commands(mess)[kind])
    check_one_line(outcome)
    assert any(word in outcome.stderr for word in words.split("|")), outcome.stderr


def commands(mess: Mess) -> dict[str, tuple[str | Path, ...]]:
    """The command that reads each kind of file."""
    return {
        "robot": ("check", mess.run, "--robot", mess.robot),
        "config": ("config", "--config", mess.config),
        "floor": ("plan", mess.run, "--map", f"0={mess.floor}"),
        "stairways": ("check", mess.run / "stairways.json"),
        "camera": ("inspect", mess.recording),
        "depth list": ("inspect", mess.recording),
        "poses": ("inspect", mess.recording),
        "trajectory": ("inspect", mess.recording, "--trajectory", mess.recording / "slam.tum"),
        "detections": ("view", mess.run, "--page", mess.folder / "page.html"),
        "history": ("view", mess.run, "--page", mess.folder / "page.html"),
        "reference": ("view", mess.run, "--page", mess.folder / "page.html"),
        "image": ("plan", mess.run, "--map", f"0={mess.floor}"),
        "recording": ("inspect", mess.folder / "walk.bag"),
    }


def paths(mess: Mess) -> dict[str, Path]:
    return {
        "robot": mess.robot,
        "config": mess.config,
        "floor": mess.floor,
        "image": mess.folder / "0.pgm",
        "stairways": mess.run / "stairways.json",
        "camera": mess.recording / "camera.json",
        "depth list": mess.recording / "depth.txt",
        "poses": mess.recording / "groundtruth.txt",
        "trajectory": mess.recording / "slam.tum",
        "detections": mess.run / "detections.jsonl",
        "history": mess.run / "history.jsonl",
        "reference": mess.run / "recording.json",
    }


def make_pipe(path: Path) -> None:
    os.mkfifo(path)


def make_device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def make_huge(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(20 * 10**9)


def make_binary(path: Path) -> None:
    path.write_bytes(bytes(range(256)) * 8)


REPLACEMENTS: dict[str, Callable[[Path], object]] = {
    "pipe": make_pipe,
    "device": make_device,
    "huge": make_huge,
    "binary": make_binary,
    "folder": Path.mkdir,
}
KINDS = (
    "robot", "config", "floor", "image", "stairways", "camera", "depth list", "poses", "trajectory",
    "detections", "history", "reference",
)  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("replacement", REPLACEMENTS)
def test_something_else_in_the_place_of_a_file(mess: Mess, kind: str, replacement: str) -> None:
    path = paths(mess)[kind]
    path.unlink(missing_ok=True)
    REPLACEMENTS[replacement](path)
    outcome = run_limited(*commands(mess)[kind])
    if kind in ("detections", "history") and replacement in ("pipe", "device", "folder"):
        # What is no file is not there for a viewer; the rest is shown.
        assert outcome.code in (0, 1) and FAULT not in outcome.stderr
        return
    check_one_line(outcome)


CAMERA_CASES: list[tuple[str, Any, str]] = [
    ("width", 0, "width: should be greater than 0"),
    ("width", 1e9, "width: should be less than or equal to 8192"),
    ("width", True, "width: should be a valid integer"),
    ("width", "320", "width: should be a valid integer"),
    ("height", 240.5, "height: should be a valid integer"),
    ("height", -240, "height: should be greater than 0"),
    ("fx", 1e9, "fx: should be less than or equal to 1000000"),
    ("fx", None, "fx: should be a valid number"),
    ("fy", 0, "fy: should be greater than 0"),
    ("cx", "left", "cx: should be a valid number"),
    ("cy", 1e12, "cy: should be less than or equal to"),
    ("cy", 10**400, "cy: should be a"),
    ("depth_scale", 0, "depth_scale: should be greater than 0"),
    ("depth_scale", 1e12, "depth_scale: should be less than"),
    ("depth_scale", False, "depth_scale: should be a valid number"),
    ("depth_scale", GONE, "depth_scale"),
    ("up", [0, 0, 0], "up"),
    ("up", [0, -1], "up: list should have at least 3 items"),
    ("up", "down", "up: should be a valid list"),
    ("up", [0, -1, 1e300], "up.2: should be less than or equal to"),
]


@pytest.mark.parametrize(("key", "value", "word"), CAMERA_CASES)
def test_bad_camera_json(mess: Mess, key: str, value: Any, word: str) -> None:
    mess.change(mess.recording / "camera.json", (key,), value)
    check_one_line(run_limited("inspect", mess.recording), "camera.json", word)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ('{"width": 320, "width": 640}', "twice"),
        ("[" * 100_000, "expected JSON"),
        ("[320, 240]", "expected an object"),
        ("", "expected JSON"),
    ],
)
def test_camera_json_that_is_none(mess: Mess, text: str, word: str) -> None:
    (mess.recording / "camera.json").write_text(text)
    check_one_line(run_limited("run", mess.recording), "camera.json", word)


CONFIG_CASES = {
    "detection: {min_steps: true}": "should be a valid integer, got True",
    "detection: {min_steps: '3'}": "should be a valid integer",
    "detection: {min_steps: 3.5}": "should be a valid integer",
    "detection: {min_steps: 1}": "greater than or equal to 2",
    "detection: {max_depth: .inf}": "finite",
    "detection: {max_depth: .nan}": "finite|greater",
    "detection: {max_depth: 1.0e+300}": "less than or equal to 20",
    "detection: {max_depth: [6]}": "should be a valid number",
    "detection: {max_depth: null}": "should be a valid number",
    "detection: 3": "is a section",
    "detektion: {max_depth: 3}": "did you mean",
    "envelope: {min_rise: 0.3}": "must be below max_rise",
    "envelope: {min_width: 1.0e+9}": "less than or equal to 20",
    "delmerico2013: {min_cluster_points: 99999999999}": "less than or equal to",
    "1: 2": "unknown config key 1",
    "? [a, b]\n: 3": "not a YAML file|unknown",
}


@pytest.mark.parametrize("text", CONFIG_CASES)
def test_bad_config(mess: Mess, text: str) -> None:
    mess.config.write_text(text)
    outcome = run_limited("config", "--config", mess.config)
    check_one_line(outcome)
    assert any(word in outcome.stderr for word in CONFIG_CASES[text].split("|")), outcome.stderr


MAP_CASES: list[tuple[str, Any, str]] = [
    ("image", GONE, "lacks the key 'image'"),
    ("image", 3, "image"),
    ("image", "none.pgm", "none.pgm"),
    ("image", "", "image"),
    ("resolution", 0, "resolution"),
    ("resolution", True, "resolution"),
    ("resolution", 1e9, "resolution"),
    ("origin", [0, 0], "origin"),
    ("origin", [1e300, 0, 0], "origin"),
    ("origin", [0, 0, 0.5], "not turned"),
    ("negate", 2, "negate"),
    ("occupied_thresh", 2, "occupied_thresh"),
    ("free_thresh", 0.9, "free_thresh"),
    ("mode", "scale", "mode"),
]


@pytest.mark.parametrize(("key", "value", "word"), MAP_CASES)
def test_bad_map(mess: Mess, key: str, value: Any, word: str) -> None:
    mess.change(mess.floor, (key,), value)
    check_one_line(run_limited("plan", mess.run, "--map", f"0={mess.floor}"), word)


IMAGES = {
    "empty": b"",
    "cut short": b"P5\n8 8\n255\n123",
    "size that fills the memory": b"P5\n100000 100000\n255\n" + bytes(64),
    "no numbers": b"P5\nx y\n255\n",
    "no picture": b"hello",
}


@pytest.mark.parametrize("name", IMAGES)
def test_bad_map_image(mess: Mess, name: str) -> None:
    (mess.folder / "0.pgm").write_bytes(IMAGES[name])
    check_one_line(run_limited("plan", mess.run, "--map", f"0={mess.floor}"), "0.pgm")


POSES = {
    "one number missing": ("0.0 0 0 0 0 0 0\n", "expected 8 columns"),
    "commas": ("0.0,0,0,0,0,0,0,1\n", "not commas"),
    "not a number": ("0.0 0 0 x 0 0 0 1\n", "finite numbers"),
    "not finite": ("0.0 0 0 1e999 0 0 0 1\n", "finite numbers"),
    "far away": ("0.0 0 0 1e9 0 0 0 1\n", "within 1e+07 m"),
    "quaternion of length 2": ("0.0 0 0 0 0 0 0 2\n", "unit quaternion"),
    "no quaternion": ("0.0 0 0 0 0 0 0 0\n", "unit quaternion"),
    "stamp twice": ("0.0 0 0 0 0 0 0 1\n0.0 0 0 0 0 0 0 1\n", "stamps that increase"),
    "stamp in nanoseconds": ("1e30 0 0 0 0 0 0 1\n", "nanoseconds"),
    "stamp without end": ("1e999999999 0 0 0 0 0 0 1\n", "stamp in seconds"),
    "nothing": ("# nothing\n", "it has none"),
}


@pytest.mark.parametrize("name", POSES)
def test_bad_poses(mess: Mess, name: str) -> None:
    text, word = POSES[name]
    (mess.recording / "groundtruth.txt").write_text(text)
    check_one_line(run_limited("run", mess.recording), "groundtruth.txt", word)


LISTS = {
    "nothing": ("", "lists no image"),
    "one column": ("0.0\n", "expected 2 columns"),
    "absolute path": ("0.0 /etc/passwd\n", "/etc/passwd"),
    "path that leaves": ("0.0 ../bot.yaml\n", "bot.yaml"),
    "file that is none": ("0.0 depth\n", "not there"),
    "stamp that is none": ("now depth/000000.png\n", "stamp in seconds"),
    "stamps that go back": ("1.0 depth/000000.png\n0.5 depth/000001.png\n", "stamps that increase"),
}


@pytest.mark.parametrize("name", LISTS)
def test_bad_list_of_images(mess: Mess, name: str) -> None:
    text, word = LISTS[name]
    (mess.recording / "depth.txt").write_text(text)
    check_one_line(run_limited("detect", mess.recording), "depth.txt", word)


REFERENCES = {
    "no JSON": "{",
    "list": "[]",
    "path of a number": '{"path": 3, "options": {}}',
    "path with zero": '{"path": "a\\u0000b", "options": {}}',
    "options of a number": '{"path": "a", "options": {"up": 3}}',
    "identity cut short": '{"path": "a", "options": {}, "identity": {"num_frames": 3}}',
    "key twice": '{"path": "a", "path": "b", "options": {}}',
}


@pytest.mark.parametrize("name", REFERENCES)
def test_bad_recording_json(mess: Mess, name: str) -> None:
    (mess.run / "recording.json").write_text(REFERENCES[name])
    check_one_line(run_limited("view", mess.run, "--page", mess.folder / "p.html"), "recording.json")
    check_one_line(run_limited("plan", mess.run), "recording.json")


LINES = {
    "no JSON": "{\n",
    "number": "3\n",
    "key missing": '{"stamp_ns": 3}\n',
    "text for a number": '{"stamp_ns": "3", "observations": [], "rejections": [], "stairways": []}\n',
    "key twice": '{"stamp_ns": 3, "stamp_ns": 4}\n',
}


@pytest.mark.parametrize("name", LINES)
@pytest.mark.parametrize("file", ["detections.jsonl", "history.jsonl"])
def test_bad_log(mess: Mess, name: str, file: str) -> None:
    path = mess.run / file
    path.write_text(LINES[name] + path.read_text())
    check_one_line(run_limited("view", mess.run, "--page", mess.folder / "p.html"), f"{file}, line 1")


USAGE: list[tuple[str, ...]] = [
    ("run",), ("run", "a", "b"), ("run", "a", "--method", "magic"), ("run", "a", "--up", "z"), ("detect",),
    ("inspect", "a", "--frame", "one"), ("inspect", "a", "--frame", "1", "-o", "x.jpg"), ("check",),
    ("check", "a", "--picture", "x.jpg"), ("export", "a"), ("export", "a", "-f", "dxf"),
    ("export", "a", "-f", "osm", "--anchor", "x"), ("plan",), ("plan", "a", "--map", "x"),
    ("plan", "a", "--from", "nan,0"), ("plan", "a", "--from", "1e300,0"), ("plan", "a", "--to", "0,inf"),
    ("plan", "a", "--camera-height", "nan"), ("plan", "a", "--camera-height", "-1"),
    ("export", "a", "-f", "osm", "--anchor", "nan,0"),
    ("export", "a", "-f", "osm", "--anchor", "4,1,1e300"), ("simulate", "b3", "--factor", "nan"),
    ("plan", "a", "--from", "1"), ("plan", "a", "--to", "1,2,3,4"), ("simulate",), ("simulate", "castle"),
    ("simulate", "b3", "--factor", "9"), ("simulate", "b3", "--seed", "-1"), ("evaluate",),
    ("evaluate", "castles"), ("view", "a", "--page", "x.txt"), ("view", "a", "--every", "0"), ("finish",),
    ("fly",), ("--fly",), ("live", "--frames", "0"),
]  # fmt: skip


@pytest.mark.parametrize("arguments", USAGE, ids=" ".join)
def test_wrong_usage(arguments: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = run_limited(*arguments)
    assert outcome.code == 2
    assert outcome.stdout == "" and "Traceback" not in outcome.stderr
    assert "Usage: stairmap" in outcome.stderr
    assert list(tmp_path.iterdir()) == []


REFUSED: list[tuple[tuple[str, ...], str]] = [
    (("run", "nowhere"), "there is no nowhere"),
    (("run", "stairs", "--trajectory", "nowhere.tum"), "nowhere.tum"),
    (("run", "stairs", "--config", "nowhere.yaml"), "nowhere.yaml"),
    (("run", "stairs", "--set", "x"), "section.key=value"),
    (("run", "stairs", "--set", "a.b=&a [*a]"), "cannot read the value|unknown"),
    (("run", "stairs", "--set", "detection.min_steps=true"), "valid integer"),
    (("run", "stairs", "--robot", "nobody"), "no robot 'nobody'"),
    (("run", "stairs", "--robot", "nobody.yaml"), "nobody.yaml"),
    (("run", "stairs", "--pose-format", "zyx"), "--pose-format"),
    (("run", "stairs", "--odometry", "--trajectory", "x.tum"), "leave one out"),
    (("run", "stairs", "--depth-topic", "/d"), "is a folder"),
    (("run", "stairs/depth.txt"), "is a file"),
    (("run", "bot.yaml"), "bot.yaml"),
    (("run", "run"), "depth.txt"),
    (("run", "stairs", "-o", "run"), "not empty"),
    (("run", "stairs", "-o", "bot.yaml"), "is a file"),
    (("inspect", "stairs", "--frame", "99"), "from 0 to 2"),
    (("inspect", "stairs", "--frame", "0", "-o", "0.png"), "there already"),
    (("check", "run", "--code", "castle"), "no building code"),
    (("check", "run", "--picture", "0.png"), "there already"),
    (("check", "stairs"), "stairways.json"),
    (("export", "run", "-f", "osm"), "--anchor"),
    (("export", "run", "-f", "ply", "-o", "bot.yaml"), "cannot write"),
    (("plan", "run", "--map", "7=0.yaml"), "no floor 7"),
    (("plan", "run", "--map", "0=0.yaml", "--map", "0=0.yaml"), "two maps"),
    (("plan", "run", "--recording", "nowhere"), "nowhere"),
    (("plan", "run", "--recording", "stairs"), "another one: frames 3 instead of 8"),
    (("view", "run", "--page", "p.html", "--recording", "stairs"), "another one: frames 3 instead of 8"),
    (("view", "run", "--page", "0.html"), "there already"),
    (("view", "stairs", "--page", "p.html"), "stairmap run"),
    (("finish", "stairs"), "expected the folder of a run"),
    (("finish", "nowhere"), "expected the folder of a run"),
    (("evaluate", "buildings", "--data", "run"), "docs/evaluation.md"),
    (("evaluate", "real", "--data", "run"), "docs/evaluation.md"),
    (("simulate", "building:castle", "--buildings", "run"), "castle"),
]


@pytest.mark.parametrize(("arguments", "words"), REFUSED, ids=lambda value: " ".join(value)[:60])
def test_refusal(arguments: tuple[str, ...], words: str, mess: Mess, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(mess.folder)
    for name in ("0.png", "0.html"):
        (mess.folder / name).write_text("mine")
    outcome = run_limited(*arguments)
    check_one_line(outcome)
    assert any(word in outcome.stderr for word in words.split("|")), outcome.stderr
    assert (mess.folder / "0.png").read_text() == (mess.folder / "0.html").read_text() == "mine"


def test_there_are_enough_cases(request: pytest.FixtureRequest) -> None:
    mine = [item for item in request.session.items if item.path == request.path]
    assert len(mine) >= 150 or len(request.session.items) < 150
