"""``stairmap evaluate``: suites of trials with known truth, one table for all methods."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from stairmap.cli.evaluate_request import EvaluateRequest
from stairmap.cli.progress import TrialProgress
from stairmap.config import Config, load_config
from stairmap.errors import CrashedTrialsError
from stairmap.evaluation.cloud_suites import CLOUD_SUITES, make_cloud_specs
from stairmap.evaluation.cloud_trials import FINISHED_MAPS, METHOD, SWEEPS, run_cloud_trial
from stairmap.evaluation.convergence import draw_convergences, record_convergence
from stairmap.evaluation.detection_rates import QUICK_GRID, RateGrid, RatePanel, measure_panels
from stairmap.evaluation.frame_judging import FrameJudgement
from stairmap.evaluation.kind_tables import format_kinds, summarize_kinds
from stairmap.evaluation.rate_plots import draw_rates
from stairmap.evaluation.real import RealResult, run_real_suite
from stairmap.evaluation.running import TrialSettings, run_trials
from stairmap.evaluation.suites import SIMULATED_SUITES, TrialChoice, make_specs
from stairmap.evaluation.tables import format_all, format_real
from stairmap.evaluation.trials import TrialResult, TrialSpec
from stairmap.evaluation.view_running import make_view_specs, run_views
from stairmap.output_files import check_new_folder, output_error, write_whole
from stairmap.pipeline import METHODS
from stairmap.simulation.finished_maps import MAP_KINDS
from stairmap.simulation.kinds import ViewSpec
from stairmap.simulation.lidars import LIDARS
from stairmap.simulation.render import check_ray_caster
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.sensors import SENSORS
from stairmap.visualization.plots import make_figure, png_from_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def evaluate_methods(request: EvaluateRequest) -> int:
    """Run the suites and print the tables; return the exit code.

    Raises
    ------
    StairmapError
        If the configuration, the data or a package is missing, or the output cannot be written.
    """
    config = load_config(request.config_file, request.overrides)
    if request.output is not None:
        check_new_folder(request.output)
    specs = _make_specs(request)
    views = _make_view_specs(request)
    points = _make_cloud_specs(request)
    _check_packages(request, is_simulated=bool(specs or views or points or "rates" in request.suites))
    results = _run_simulated(request, config, specs)
    results += _run_without_camera(request, config, points)
    real: tuple[RealResult, ...] = ()
    if "real" in request.suites:
        real = run_real_suite(request.data / "real", request.methods, config=config, only=request.only)
    panels: tuple[RatePanel, ...] = ()
    grid = QUICK_GRID if request.is_quick else RateGrid()
    if "rates" in request.suites:
        panels = _measure_rates(request, config, grid)
    judgements = {method: _judge_views(request, config, method, views) for method in request.methods if views}
    tables = [format_all(results, request.methods)] if results else []
    tables += [format_real(real)] if real else []
    tables += [format_kinds(f"{method}, by kind", mine) for method, mine in judgements.items()]
    data = {
        "trials": [result.to_dict() for result in results],
        "real": [result.to_dict() for result in real],
        "rates": [panel.to_dict() for panel in panels],
        "kinds": {
            method: {
                "summaries": summarize_kinds(mine),
                "views": [judgement.to_dict() for judgement in mine],
            }
            for method, mine in judgements.items()
        },
    }
    typer.echo(json.dumps(data, allow_nan=False) if request.as_json else "\n\n".join(tables))
    if request.output is not None:
        _write_text(request.output / "tables.md", "\n\n".join(tables) + "\n")
        _write_text(request.output / "results.json", json.dumps(data, allow_nan=False) + "\n")
        for method in request.methods if panels else ():
            mine = [panel for panel in panels if panel.method == method]
            _write_figure(request.output / f"recall_{method}.png", draw_rates(mine, grid, rate="recall"))
            _write_figure(request.output / f"false_{method}.png", draw_rates(mine, grid, rate="false_rate"))
        if request.with_convergence:
            _draw_convergences(request, config, specs, request.output)
        if not request.as_json:
            typer.echo(str(request.output))
    _check_no_crash(results)
    return 0


def _check_packages(request: EvaluateRequest, *, is_simulated: bool) -> None:
    """Miss a package before hours of trials, not after.

    Raises
    ------
    MissingPackageError
        If one that the suites or the pictures need is not installed.
    """
    if is_simulated:
        check_ray_caster()
    if request.output is not None and ("rates" in request.suites or request.with_convergence):
        make_figure(width=1, height=1)


def _check_no_crash(results: Sequence[TrialResult]) -> None:
    """Tell of trials that crashed; their rows are in the tables.

    Raises
    ------
    CrashedTrialsError
        If there are any.
    """
    crashed = [result for result in results if result.crash is not None]
    if crashed:
        raise CrashedTrialsError(
            f"{len(crashed)} of {len(results)} trials crashed; the first: {crashed[0].spec}, "
            f"{crashed[0].method}: {crashed[0].crash}"
        )


def _trial_choice(request: EvaluateRequest) -> TrialChoice:
    return TrialChoice(
        only=request.only,
        sensor=request.sensor,
        width=request.width,
        robot=request.robot,
        seed=request.seed,
        num_drives=request.num_drives,
        is_quick=request.is_quick,
    )


def _make_specs(request: EvaluateRequest) -> tuple[TrialSpec, ...]:
    choice = _trial_choice(request)
    suites = [suite for suite in request.suites if suite in SIMULATED_SUITES]
    buildings = request.data / "buildings"
    specs = tuple(spec for suite in suites for spec in make_specs(suite, choice, buildings=buildings))
    if suites and not specs and "real" not in request.suites:
        raise typer.BadParameter(f"no scene of {', '.join(suites)} is called {' or '.join(request.only)}")
    cameras = request.sensor if suites else None
    for name, value, known in (("sensor", cameras, SENSORS), ("robot", request.robot, ROBOTS)):
        if value is not None and value not in known:
            raise typer.BadParameter(f"--{name}: {value!r} is not one of {', '.join(sorted(known))}")
    return specs


def _make_cloud_specs(request: EvaluateRequest) -> tuple[TrialSpec, ...]:
    suites = [suite for suite in request.suites if suite in CLOUD_SUITES]
    known = {FINISHED_MAPS: MAP_KINDS, SWEEPS: LIDARS}
    for suite in suites:
        if request.sensor is not None and request.sensor not in known[suite]:
            names = ", ".join(sorted(known[suite]))
            raise typer.BadParameter(f"--sensor: {request.sensor!r} is not one of {names} ({suite})")
    choice = _trial_choice(request)
    buildings = request.data / "buildings"
    return tuple(spec for suite in suites for spec in make_cloud_specs(suite, choice, buildings=buildings))


def _make_view_specs(request: EvaluateRequest) -> tuple[ViewSpec, ...]:
    if "kinds" not in request.suites:
        return ()
    try:
        return make_view_specs(request.kinds, seed=request.seed, is_quick=request.is_quick)
    except ValueError as error:
        raise typer.BadParameter(f"--kind: {error}") from error


def _judge_views(
    request: EvaluateRequest, config: Config, method: str, specs: Sequence[ViewSpec]
) -> tuple[FrameJudgement, ...]:
    with TrialProgress(len(specs), unit="view") as progress:

        def count(judgements: tuple[FrameJudgement, ...]) -> None:
            for judgement in judgements:
                progress.advance(f"{method}, {judgement.kind}")

        return run_views(
            specs,
            METHODS[method][0],
            config=config,
            cache=request.cache,
            num_workers=_num_workers(request),
            on_judgements=count,
        )


def _run_simulated(
    request: EvaluateRequest, config: Config, specs: Sequence[TrialSpec]
) -> tuple[TrialResult, ...]:
    settings = TrialSettings(
        methods=request.methods,
        config=config,
        buildings=request.data / "buildings",
        cache=request.cache,
    )
    with TrialProgress(len(specs)) as progress:
        return run_trials(
            specs,
            settings,
            num_workers=_num_workers(request),
            on_results=lambda results: progress.advance(str(results[0].spec)),
        )


def _run_without_camera(
    request: EvaluateRequest, config: Config, specs: Sequence[TrialSpec]
) -> tuple[TrialResult, ...]:
    if not specs:
        return ()
    settings = TrialSettings(methods=(METHOD,), config=config, buildings=request.data / "buildings")
    with TrialProgress(len(specs)) as progress:
        return run_trials(
            specs,
            settings,
            num_workers=_num_workers(request),
            on_results=lambda results: progress.advance(str(results[0].spec)),
            trial=run_cloud_trial,
        )


def _measure_rates(request: EvaluateRequest, config: Config, grid: RateGrid) -> tuple[RatePanel, ...]:
    with TrialProgress(len(grid.panels())) as progress:
        return measure_panels(
            grid,
            request.methods,
            config=config,
            num_workers=_num_workers(request),
            on_panel=lambda panel: progress.advance(f"{panel.sensor}, {panel.height:g} m"),
        )


def _draw_convergences(
    request: EvaluateRequest, config: Config, specs: Sequence[TrialSpec], folder: Path
) -> None:
    with TrialProgress(len(specs)) as progress:
        for spec in specs:
            progress.advance(str(spec))
            convergence = record_convergence(
                spec,
                request.methods,
                config=config,
                buildings=request.data / "buildings",
                cache=request.cache,
            )
            if convergence is not None:
                name = f"convergence_{spec.folder_name()}.png"
                _write_figure(folder / name, draw_convergences(convergence))


def _num_workers(request: EvaluateRequest) -> int:
    return request.num_workers or os.cpu_count() or 1


def _write_figure(path: Path, figure: Figure) -> None:
    _write(path, png_from_figure(figure))


def _write_text(path: Path, text: str) -> None:
    _write(path, text.encode("utf-8"))


def _write(path: Path, data: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise output_error(path, error) from error
    write_whole(path, data)
