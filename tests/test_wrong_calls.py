"""Wrong calls of every command, as a newcomer types them: an exit code and a line, no traceback."""

from __future__ import annotations

import os
import shlex
from pathlib import Path

import pytest

from command_line import stairmap
from corruptible_files import write_corruptible_files
from documented_messages import DOCUMENTED
from stairmap.cli.exits import FAULT
from test_bad_inputs import limits

CALLS = """
scan nowhere.ply
scan empty
scan text.txt
scan e.ply
scan dead.lnk
scan pipe.pcd
scan /dev/zero
scan few.xyz
scan nan.xyz
scan far.xyz
scan map.xyz --up q
scan map.xyz --unit league
scan map.xyz --config nowhere.yaml
scan map.xyz --set detection.max_depth=nan
scan map.xyz -o run
scan map.xyz map.xyz nowhere.las
scan map.xyz --robot nobody
scan run
scan 0.pgm
scan walk.bag
scan
clean
clean map.xyz
clean map.xyz -o out.txt
clean nowhere.ply -o out.ply
clean map.xyz -o map.xyz
clean map.xyz -o nowhere/out.ply
clean map.xyz -o out.ply --run run
clean map.xyz -o out.ply --run nowhere
clean map.xyz -o out.ply --up q
clean text.txt -o out.ply
explore
explore castle
explore two_floors --robot nobody
explore two_floors --robot text.txt
explore two_floors --seed -1
explore two_floors --strategy luck
explore two_floors -o run
explore building:nowhere --buildings buildings
explore building:../house --buildings buildings
batch
batch -o fleet2
batch stairs -o text.txt --workers 0
batch stairs -o run --workers 0
batch @nowhere.txt -o b --workers 0
batch stairs -o b --workers -1
batch stairs -o b --workers many
batch stairs -o b --workers 0 --robot nobody
batch stairs -o b --workers 0 --config text.txt
batch stairs -o b --workers 0 --set x=1
batch stairs -o b --workers 0 --up q
batch stairs -o b --workers 0 --method magic
batch stairs -o b --scheduler nonsense
merge
merge run run
merge run nowhere
merge run text.txt
merge run empty
merge run other --alignment nowhere.yaml
merge run other --alignment al.yaml
merge run other --alignment al2.yaml
merge run other --alignment text.txt
merge run other -o run
benchmark --program x
benchmark --program x=
benchmark --program x='a
benchmark --no-own
benchmark --seed -1
benchmark --timeout 0
benchmark --timeout nan
benchmark --frames -1
live
run x.bag
run x.mcap
run x.db3
run walk.bag --map-frame moon
run walk.bag --depth-topic /no
run walk.bag --pose-topic /no
run walk.bag --camera nowhere.json
run walk.bag --camera text.txt
run walk.bag --cloud-topic /no
run grids.mcap --cloud-topic /elevation_mapping/elevation_map:slope
run grids.mcap --cloud-topic /elevation_mapping/elevation_map --up +x
run dead.lnk
run stairs/camera.json
export nowhere -f ply
export run -f nav2-graph --map 0=nowhere.yaml
export run -f nav2-graph --map 0=0.pgm
export run -f ply --map 0=0.yaml
export run -f osm --anchor 99,0
export run -f keepout --robot nobody
view nowhere --page p.html
view run --page p.txt
view run --page run.html --recording text.txt
view run --mcap x
view run --foxglove x.txt
view run --web --port 99999999
view run --save p.txt
evaluate table1 --only moon
evaluate table1 --width 0
evaluate table1 --drives 0
evaluate table1 --robot dog
evaluate table1 --sensor eyes
batch stairs -o b --scheduler nonsense://x
""".strip().splitlines()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("calls")
    write_corruptible_files(folder)
    (folder / "empty").mkdir()
    (folder / "text.txt").write_text("hello\n")
    (folder / "lists.txt").write_text("@lists.txt\n")
    (folder / "e.ply").write_bytes(b"")
    (folder / "dead.lnk").symlink_to("nowhere")
    os.mkfifo(folder / "pipe.pcd")
    for name, begin in (
        ("x.bag", b"#ROSBAG V2.0\n"),
        ("x.mcap", b"\x89MCAP0\r\n"),
        ("x.db3", b"SQLite format 3\0"),
    ):
        (folder / name).write_bytes(begin)
    (folder / "few.xyz").write_text("1 2 3\n" * 5)
    (folder / "nan.xyz").write_text("nan nan nan\n" * 300)
    (folder / "far.xyz").write_text("".join(f"{index}e20 1 1\n" for index in range(300)))
    (folder / "al.yaml").write_text("runs: {run: {x: 1e30, y: 0, yaw_deg: 0}}")
    (folder / "al2.yaml").write_text("runs: 3")
    return folder


@pytest.mark.parametrize("call", CALLS)
def test_wrong_call_is_told_in_a_line(call: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    words = call.split() if call.count("'") % 2 else shlex.split(call)
    with limits():
        outcome = stairmap(*words)
    text = outcome.stdout + outcome.stderr
    assert outcome.code in (1, 2), text
    assert FAULT not in text and "Traceback" not in text and "not enough memory" not in text
    if outcome.code == 1:
        errors = [line for line in outcome.stderr.splitlines() if line.startswith("error: ")]
        assert len(errors) == 1 and outcome.stderr.endswith(f"{errors[0]}\n"), outcome.stderr
        assert any(pattern.search(errors[0]) for pattern in DOCUMENTED), errors
