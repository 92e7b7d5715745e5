"""Put single faults into the code, one at a time, and count how many the tests notice.

cosmic-ray finds and makes the faults (``CONTRIBUTING.md``, "Mutants", says why). Each one is tried in a copy
of ``src`` with the tests of its own folder. A fault that no test notices *survives*: it is printed with its
place and its diff. ``--write`` puts the score into the section "mutants" of BENCHMARKS.md.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import json
import os
import queue
import random
import shlex
import shutil
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import NamedTuple

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.number_replacer import NumberReplacer
from cosmic_ray.operators.operator import Operator
from cosmic_ray.plugins import get_operator, operator_names
from cosmic_ray.testing import run_tests
from document import ROOT, BenchmarkRun, describe_run, write_section
from parso.python.tree import Number

FOLDERS = ("detection", "modeling", "navigation", "export")
NUM_MUTANTS = 60
SEED = 10
NUM_WORKERS = 2
GOAL = 0.85
"""Share of a random sample that must be noticed."""

TIMEOUT_FACTOR = 3.0
"""Tests that take this many times longer than on the right code hang: the fault is noticed."""
TIMEOUT_EXTRA = 20.0
"""Added to it for the start of Python on a busy machine, s."""

CONVENTIONS = "tests/test_conventions.py"
"""What holds for the code of every folder, tried for each fault."""

# fmt: off
LIKELY_SWAPS = frozenset([
    "Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "FloorDiv_Mul", "Mod_FloorDiv", "Pow_Mul",
    "LShift_RShift", "RShift_LShift", "BitOr_BitAnd", "BitAnd_BitOr", "BitXor_BitAnd", "Delete_USub",
    "Delete_Invert", "Delete_Not", "Is_IsNot", "IsNot_Is", "Eq_NotEq", "NotEq_Eq", "Lt_LtE", "Lt_GtE",
    "LtE_Lt", "LtE_Gt", "Gt_GtE", "Gt_LtE", "GtE_Gt", "GtE_Lt",
])
# fmt: on
"""Of cosmic-ray's 190 exchanges of operators those that a slip could make. Most others, such as ``a >> b``
for ``a * b``, raise at once: any test that runs the line would count as a good one."""


class Fault(NamedTuple):
    """One change that cosmic-ray can make to a module: an operator at its nth occurrence."""

    module: str
    line: int
    operator: str
    occurrence: int


class ScaleNumber(NumberReplacer):
    """cosmic-ray's operator for numbers, but floats are doubled or halved: a metre is noticed easily."""

    def mutate(self, node: Number, index: int) -> Number:
        """Return another number in a number's place."""
        value = ast.literal_eval(node.value)
        if not isinstance(value, float) or value == 0:
            return super().mutate(node, index)
        return Number(repr(value * (2.0, 0.5)[index]), node.start_pos, node.prefix)


@dataclass(frozen=True, slots=True, kw_only=True)
class Mutant:
    """One fault: its module (path from the root), line, operator and mutated source."""

    module: str
    line: int
    operator: str
    source: str = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What the tests said of a mutant: ``killed``, ``timeout`` or ``survived``."""

    module: str
    line: int
    operator: str
    status: str
    seconds: float
    diff: str


def main() -> None:
    """Try a sample of faults and report the score."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--folders", nargs="+", default=FOLDERS, metavar="FOLDER", help="or modules, below src/stairmap"
    )
    parser.add_argument("--num-mutants", type=int, default=NUM_MUTANTS)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--workers", type=int, default=NUM_WORKERS)
    parser.add_argument(
        "--output", type=Path, default=ROOT / "results/mutants.json", help="JSON of all outcomes"
    )
    parser.add_argument("--write", action="store_true", help="write the section of BENCHMARKS.md")
    arguments = parser.parse_args()
    run = BenchmarkRun()
    points = find_points(arguments.folders)
    mutants = sample_mutants(points, arguments.num_mutants, random.Random(arguments.seed))
    print(f"{len(points)} places in {', '.join(arguments.folders)}; {len(mutants)} mutants", flush=True)
    outcomes = try_mutants(mutants, num_workers=arguments.workers)
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    arguments.output.write_text(json.dumps([asdict(outcome) for outcome in outcomes], indent=1) + "\n")
    for outcome in outcomes:
        if outcome.status == "survived":
            print(f"\nsurvived: {outcome.module}:{outcome.line}\n{outcome.diff}")
    text = describe_outcomes(outcomes, num_points=len(points))
    print(f"\n{text}\n{arguments.output}")
    if arguments.write:
        write_section("mutants", f"## Mutants\n\n{describe_run(run)}\n\n{text}")


def find_points(folders: Sequence[str]) -> list[list[Fault]]:
    """Return the faults that can be made at each place of the code, places in order."""
    points: dict[tuple[object, ...], list[Fault]] = defaultdict(list)
    for folder in folders:
        place = ROOT / "src/stairmap" / folder
        for path in [place] if place.is_file() else sorted(place.glob("*.py")):
            source = path.read_text(encoding="utf-8")
            spans = annotation_spans(source)
            nodes = list(ast_nodes(get_ast(source)))
            for name in _operator_names():
                positions = [
                    (node, span) for node in nodes for span in _operator(name).mutation_positions(node)
                ]
                for occurrence, (node, (start, end)) in enumerate(positions):
                    # The star alone in a signature is no product.
                    is_star = getattr(node.parent, "type", None) == "parameters"
                    if not is_star and not any(first <= start < last for first, last in spans):
                        module = path.relative_to(ROOT).as_posix()
                        points[module, start, end].append(Fault(module, start[0], name, occurrence))
    return [points[key] for key in sorted(points)]


def annotation_spans(source: str) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Return start and end of each annotation: Python never evaluates them, so no change there is a fault."""
    annotations = []
    for node in ast.walk(ast.parse(source)):
        annotations.append(getattr(node, "annotation", None))
        annotations.append(getattr(node, "returns", None))
    return [
        ((node.lineno, node.col_offset), (node.end_lineno or 0, node.end_col_offset or 0))
        for node in annotations
        if isinstance(node, ast.expr)
    ]


def sample_mutants(points: list[list[Fault]], num_mutants: int, generator: random.Random) -> list[Mutant]:
    """Cut the places into equal parts, in their order, and return a mutant at one place of each part."""
    mutants = []
    num_mutants = min(num_mutants, len(points))
    for part in range(num_mutants):
        first, end = part * len(points) // num_mutants, (part + 1) * len(points) // num_mutants
        # A draw that is no Python, such as {*a} for {**a}, is drawn again.
        while (mutant := _make_mutant(generator.choice(points[generator.randrange(first, end)]))) is None:
            pass
        mutants.append(mutant)
    return mutants


def try_mutants(mutants: Sequence[Mutant], *, num_workers: int) -> list[Outcome]:
    """Run the tests of each mutant, in as many copies of ``src`` as there are workers."""
    outcomes = []
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(num_workers) as executor:
        copies: queue.SimpleQueue[Path] = queue.SimpleQueue()
        for worker in range(num_workers):
            ignored = shutil.ignore_patterns("__pycache__")
            copies.put(Path(shutil.copytree(ROOT / "src", Path(folder) / str(worker), ignore=ignored)))
        limits = _time_limits({_tests_of(mutant.module)[1:] for mutant in mutants}, Path(folder) / "0")
        futures = [executor.submit(_try_mutant, mutant, copies, limits) for mutant in mutants]
        try:
            for number, future in enumerate(as_completed(futures), start=1):
                outcome = future.result()
                outcomes.append(outcome)
                place = f"{outcome.module}:{outcome.line}"
                print(f"{number}/{len(mutants)} {outcome.status} {outcome.seconds:.0f} s {place}", flush=True)
        finally:
            # After Ctrl-C those that have not begun are not tried any more.
            executor.shutdown(cancel_futures=True)
    return sorted(outcomes, key=lambda outcome: (outcome.module, outcome.line))


def describe_outcomes(outcomes: Sequence[Outcome], *, num_points: int) -> str:
    """Return the score by folder and the survivors as Markdown."""
    lines = [
        "| folder | mutants | noticed | of these by a timeout | score |",
        "| --- | --: | --: | --: | --: |",
    ]
    folders = [outcome.module.split("/")[2] for outcome in outcomes]
    for name in (*sorted(set(folders)), "all"):
        of_folder = [o.status for o, folder in zip(outcomes, folders, strict=True) if name in (folder, "all")]
        num_killed = len(of_folder) - of_folder.count("survived")
        lines.append(
            f"| {name} | {len(of_folder)} | {num_killed} | {of_folder.count('timeout')} "
            f"| {num_killed / len(of_folder):.0%} |"
        )
    survivors = [o for o in outcomes if o.status == "survived"]
    score = 1 - len(survivors) / len(outcomes)
    lines += ["", f"Goal: {GOAL:.0%} of a random sample, here of {num_points:,} places: "]
    lines[-1] += f"{score:.0%}, {'met' if score >= GOAL else 'not met'}."
    if survivors:
        lines += ["", "Not noticed:", ""]
        for outcome in survivors:
            changed = [line for line in outcome.diff.splitlines()[2:] if line[:1] in "+-"]
            was, now = (" ".join(line[1:].strip() for line in changed if line[0] == sign) for sign in "-+")
            lines.append(f"- `{outcome.module}:{outcome.line}`: `{was}` → `{now}`")
    return "\n".join(lines)


@cache
def _operator(name: str) -> Operator:
    return ScaleNumber() if name == ScaleNumber.__name__ else get_operator(name)()


@cache
def _operator_names() -> tuple[str, ...]:
    """Operators without arguments, of the exchanges only the likely ones."""
    names = []
    for name in operator_names():
        family, _, swap = name.removeprefix("core/").partition("_")
        is_wanted = family != NumberReplacer.__name__ and (not swap or swap in LIKELY_SWAPS)
        if is_wanted and not get_operator(name).arguments():
            names.append(name)
    return (*names, ScaleNumber.__name__)


def _make_mutant(fault: Fault) -> Mutant | None:
    right = (ROOT / fault.module).read_text(encoding="utf-8")
    source = mutate_code(right, _operator(fault.operator), fault.occurrence)
    try:
        compile(source, fault.module, "exec")
    except SyntaxError:
        return None
    name = fault.operator.removeprefix("core/")
    return Mutant(module=fault.module, line=fault.line, operator=name, source=source)


def _tests_of(module: str) -> tuple[str, ...]:
    """Tests of a module's folder, those of the module itself first: they notice a fault soonest."""
    path = Path("tests") / Path(module).relative_to("src/stairmap")
    own = path.with_name(f"test_{path.name}")
    folder = own if own.parent == Path("tests") else own.parent
    return (str(own) if (ROOT / own).exists() else CONVENTIONS, CONVENTIONS, str(folder))


def _time_limits(selections: set[tuple[str, ...]], source: Path) -> dict[tuple[str, ...], float]:
    """Run the tests on the right code: they must pass, and their time gives the limit for the mutants'."""
    limits = {}
    for tests in sorted(selections):
        started = time.monotonic()
        outcome, output = run_tests(_test_command(tests, source), timeout=3600)
        if outcome != "survived":
            raise SystemExit(f"{' '.join(tests)} fail without any fault; mend them first\n{output}")
        limits[tests] = TIMEOUT_FACTOR * (time.monotonic() - started) + TIMEOUT_EXTRA
    return limits


def _try_mutant(
    mutant: Mutant, copies: queue.SimpleQueue[Path], limits: dict[tuple[str, ...], float]
) -> Outcome:
    copy = copies.get()
    path = copy / Path(mutant.module).relative_to("src")
    right = path.read_text(encoding="utf-8")
    tests = _tests_of(mutant.module)
    started = time.monotonic()
    try:
        path.write_text(mutant.source, encoding="utf-8")
        outcome, output = run_tests(_test_command(tests, copy), timeout=limits[tests[1:]])
    finally:
        path.write_text(right, encoding="utf-8")
        copies.put(copy)
    if outcome == "incompetent":
        raise SystemExit(f"the tests could not be started: {output}")
    lines = difflib.unified_diff(right.splitlines(), mutant.source.splitlines(), lineterm="", n=1)
    return Outcome(
        module=mutant.module,
        line=mutant.line,
        operator=mutant.operator,
        status="timeout" if output == "timeout" else str(outcome.value),
        seconds=round(time.monotonic() - started, 1),
        diff="\n".join(lines),
    )


def _test_command(tests: Sequence[str], source: Path) -> str:
    """Stop at the first failure; the profile of tests/conftest.py draws the same examples each time."""
    places = [str(ROOT / test) for test in dict.fromkeys(tests)]
    search_path = os.pathsep.join(filter(None, (str(source), os.environ.get("PYTHONPATH"))))
    options = ["-x", "-q", "-p", "no:cacheprovider", "--hypothesis-profile=mutants", f"--rootdir={ROOT}"]
    environment = ["env", f"PYTHONPATH={search_path}", "OPENBLAS_NUM_THREADS=1"]
    return shlex.join([*environment, sys.executable, "-m", "pytest", *options, *places])


if __name__ == "__main__":
    main()
