from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from command_line import check_refused, stairmap
from stairmap.benchmark.entry import answer
from stairmap.benchmark.programs import Answer, Program
from stairmap.benchmark.running import format_scores
from stairmap.benchmark.scores import score_answer, score_program
from stairmap.benchmark.tasks import Task, TrueFlight, make_tasks
from stairmap.errors import BenchmarkError
from stairmap.stairway import Flight, FlightStd

STD = FlightStd(rise=0, run=0, width=0, pitch=0, heading=0, base=np.zeros(3))
FLIGHT = Flight(base=np.zeros(3), heading=0.0, rise=0.17, run=0.28, width=1.2, num_risers=9, std=STD)
TASK = Task(
    kind="frame", name="t", request={"task": "frame"}, truth=(TrueFlight(flight=FLIGHT, must_be_found=True),)
)


def program(tmp_path: Path, body: str, *, timeout: float = 20.0) -> Program:
    script = tmp_path / "program.py"
    script.write_text(
        f"import json, sys, time\nfor line in sys.stdin:\n    request = json.loads(line)\n{body}"
    )
    return Program("mine", f"{sys.executable} {script}", timeout=timeout)


def test_program_answers_line_by_line_in_one_process(tmp_path: Path) -> None:
    values = {"base": [0, 0, 0], "heading": 0.1, "rise": 0.17, "run": 0.28, "width": 1.1, "num_risers": 9}
    mine = program(
        tmp_path,
        f"    flights = [{values!r}] * request['n']\n"
        "    print(json.dumps({'flights': flights, 'ms': 3.5}), flush=True)\n",
    )
    first, second = mine.ask({"n": 2}), mine.ask({"n": 0})
    mine.close()
    assert (len(first.flights), len(second.flights), first.ms, first.error) == (2, 0, 3.5, "")
    assert first.flights[0].width == 1.1 and first.flights[0].heading == 0.1


@pytest.mark.parametrize(
    ("body", "error"),
    [
        ("    sys.exit(3)\n", "it ended"),
        ("    print('hello', flush=True)\n", "its answer breaks the protocol"),
        ("    print(json.dumps({'flights': [{'rise': 0.17}]}), flush=True)\n", "lacks the key"),
        ("    print(json.dumps({'flights': []}), end='', flush=True)\n    sys.exit()\n", "it ended"),
    ],
)
def test_answer_that_is_none_is_an_error_and_the_next_task_is_asked_all_the_same(tmp_path, body, error):
    mine = program(tmp_path, body)
    for _ in range(2):
        assert error in mine.ask({}).error
    mine.close()


def test_program_that_does_not_answer_in_time_is_ended(tmp_path: Path) -> None:
    mine = program(tmp_path, "    time.sleep(60)\n", timeout=0.5)
    assert mine.ask({}).error == "no answer in 0.5 s"
    mine.close()


def test_program_that_is_not_there_is_told() -> None:
    with pytest.raises(BenchmarkError, match="cannot start mine: /nonexistent: No such file"):
        Program("mine", "/nonexistent", timeout=1).ask({})


@pytest.mark.parametrize(
    ("answered", "found", "right", "false"),
    [
        ([FLIGHT], 1, 1, 0),
        ([replace(FLIGHT, rise=0.181)], 1, 0, 0),
        ([replace(FLIGHT, run=0.296)], 1, 0, 0),
        ([replace(FLIGHT, rise=0.179, run=0.294)], 1, 1, 0),
        ([], 0, 0, 0),
        ([replace(FLIGHT, base=np.array([9.0, 0, 0]))], 0, 0, 1),
        ([FLIGHT, replace(FLIGHT, rise=0.175)], 1, 1, 1),
    ],
)
def test_scores(answered, found, right, false) -> None:
    score = score_answer(TASK, Answer(flights=tuple(answered)))
    assert (score.num_asked, score.num_found, score.num_right, score.num_false) == (1, found, right, false)


def test_flight_that_need_not_be_found_counts_neither_way() -> None:
    task = replace(TASK, truth=(TrueFlight(flight=FLIGHT, must_be_found=False),))
    score = score_answer(task, Answer(flights=(FLIGHT,)))
    assert (score.num_asked, score.num_found, score.num_false) == (0, 0, 0)


def test_row_of_a_program_leaves_skipped_tasks_out() -> None:
    answers = [
        Answer(flights=(replace(FLIGHT, rise=0.172),), ms=5.0),
        Answer(is_skipped=True),
        Answer(error="x", ms=9),
    ]
    row = score_program("mine", "frame", [TASK] * 3, answers)
    assert row is not None
    assert (row.num_tasks, row.num_asked, row.num_found, row.num_errors, row.ms) == (2, 2, 1, 1, 7.0)
    assert row.rise_mm == pytest.approx(2.0)
    assert row.first_error == f"{TASK.name}: x"
    assert format_scores([row]).endswith(f"mine: 1 failed, first {TASK.name}: x")
    assert score_program("mine", "frame", [TASK], [Answer(is_skipped=True)]) is None


def test_same_seed_gives_the_same_frames_and_every_third_shows_no_stairs(tmp_path: Path) -> None:
    first = list(make_tasks("frame", 3, seed=4, folder=tmp_path / "a"))
    second = list(make_tasks("frame", 3, seed=4, folder=tmp_path / "b"))
    for one, other in zip(first, second, strict=True):
        assert one.name == other.name
        assert one.request["map_from_camera"] == other.request["map_from_camera"]
        assert Path(one.request["depth"]).read_bytes() == Path(other.request["depth"]).read_bytes()
    assert not any(item.must_be_found for item in first[2].truth)
    other = next(iter(make_tasks("frame", 1, seed=5, folder=tmp_path / "c")))
    assert other.request["map_from_camera"] != first[0].request["map_from_camera"]


def test_own_method_answers_frames_in_the_map_and_skips_what_it_is_not_for(tmp_path: Path) -> None:
    tasks = list(make_tasks("frame", 8, seed=0, folder=tmp_path))
    found = [score_answer(task, _answered(task)) for task in tasks]
    assert sum(score.num_found for score in found) >= 2
    assert sum(score.num_false for score in found) == 0
    assert answer({"task": "cloud", "cloud": "/x"}, "delmerico2013") == {"skip": True}


def _answered(task: Task) -> Answer:
    flights = []
    for values in answer(json.loads(json.dumps(task.request)), "stairmap")["flights"]:
        flights.append(Flight(**{**values, "base": np.array(values["base"]), "std": STD}))
    return Answer(flights=tuple(flights))


def test_drive_holds_no_truth(tmp_path: Path) -> None:
    task = next(iter(make_tasks("drive", 1, seed=1, folder=tmp_path)))
    names = {path.name for path in Path(task.request["recording"]).iterdir()}
    assert names == {"depth", "depth.txt", "camera.json", "groundtruth.txt"}


def test_command_prints_one_table_of_all_programs(tmp_path: Path) -> None:
    mine = program(tmp_path, "    print(json.dumps({'flights': []}), flush=True)\n")
    command = f"mine={' '.join(mine._command)}"
    outcome = stairmap(
        "benchmark",
        "--no-own",
        "--program",
        command,
        "--frames",
        "2",
        "--drives",
        "0",
        "--clouds",
        "0",
        "--json",
    )
    assert outcome.code == 0, outcome.stderr
    (row,) = json.loads(outcome.stdout)["scores"]
    assert (row["program"], row["kind"], row["num_tasks"], row["num_found"]) == ("mine", "frame", 2, 0)
    check_refused(stairmap("benchmark", "--no-own"), "nobody is left")
    check_refused(stairmap("benchmark", "--program", "stairmap=x"), "two programs are called stairmap")
    assert stairmap("benchmark", "--program", "x").code == 2
