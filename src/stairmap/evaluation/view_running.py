"""Show a detector the views of each kind and judge what it says of them.

Frames are kept on disk between runs, rounded as a recording would hold them, with and without a cache,
so that both give the same results.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from stairmap.config import Config
from stairmap.evaluation.frame_cache import simulation_sum
from stairmap.evaluation.frame_judging import FrameJudgement, judge_frame
from stairmap.evaluation.workers import make_worker_pool
from stairmap.frame import DepthFrame
from stairmap.output_files import write_whole, write_whole_text
from stairmap.pipeline import Detector
from stairmap.recordings.depth_png import decode_depth_png, encode_depth_png
from stairmap.simulation.kinds import KINDS, ViewSpec, make_view
from stairmap.simulation.recording import DEPTH_SCALE
from stairmap.simulation.views import StepsInView, View, take_view

DetectorFactory = Callable[[Config], Detector]
"""Makes a detector; must be importable by a worker where several processes are used."""

OnJudgements = Callable[[tuple[FrameJudgement, ...]], None]

QUICK_SHARE = 4
"""A quick run shows one of so many views of each kind."""

VIEWS_PER_TASK = 10
"""Views that a process takes at a time."""


def make_view_specs(
    kinds: Sequence[str] = (), *, seed: int = 0, is_quick: bool = False, num_views: int | None = None
) -> tuple[ViewSpec, ...]:
    """Return the views of kinds.

    Parameters
    ----------
    kinds
        Names; none: all.
    seed
        Of whatever is drawn.
    is_quick
        Whether to take only the first quarter of each kind.
    num_views
        Views of each kind; ``None``: as many as the kind has.

    Raises
    ------
    ValueError
        If there is no such kind.
    """
    for name in kinds:
        if name not in KINDS:
            raise ValueError(f"unknown kind {name!r}; choose one of: {', '.join(KINDS)}")
    specs = []
    for name in kinds or KINDS:
        num = KINDS[name].num_views if num_views is None else num_views
        if is_quick:
            num = -(-num // QUICK_SHARE)
        specs += [ViewSpec(kind=name, index=index, seed=seed) for index in range(num)]
    return tuple(specs)


def load_view(spec: ViewSpec, cache: Path | None = None) -> tuple[View, DepthFrame, StepsInView | None]:
    """Return a view with its frame, and what the frame shows of the flight.

    Parameters
    ----------
    spec
        Which view.
    cache
        Folder that keeps frames between runs; ``None``: they are not kept.
    """
    view = make_view(spec)
    folder = None if cache is None else cache / simulation_sum() / "views" / spec.folder_name()
    if folder is not None and (folder / "seen.json").exists():
        depth = decode_depth_png((folder / "depth.png").read_bytes(), DEPTH_SCALE)
        data = json.loads((folder / "seen.json").read_text(encoding="utf-8"))
        return view, view.frame(depth), None if data is None else StepsInView.from_dict(data)
    exact, seen = take_view(view)
    # Through the bytes of the file, so that a first run and a later one see the same image.
    image = encode_depth_png(np.ascontiguousarray(exact), DEPTH_SCALE)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(folder / "depth.png", image, durable=False)
        text = json.dumps(None if seen is None else seen.to_dict(), allow_nan=False)
        write_whole_text(folder / "seen.json", text, durable=False)
    rounded = None if seen is None else StepsInView.from_dict(seen.to_dict())
    return view, view.frame(decode_depth_png(image, DEPTH_SCALE)), rounded


def judge_view(spec: ViewSpec, detector: Detector, *, cache: Path | None = None) -> FrameJudgement:
    """Show a detector one view and judge what it says."""
    view, frame, seen = load_view(spec, cache)
    start = time.process_time()
    detection = detector.detect(frame)
    elapsed = (time.process_time() - start) * 1e3
    judgement = judge_frame(spec.index, view, seen, detection.observations)
    rules = tuple(str(rejection) for rejection in detection.rejections)
    return replace(judgement, rejections=rules, frame_ms=elapsed)


def judge_views(
    specs: Sequence[ViewSpec],
    factory: DetectorFactory,
    *,
    config: Config | None = None,
    cache: Path | None = None,
) -> tuple[FrameJudgement, ...]:
    """Judge one detector on views, in this process."""
    detector = factory(Config() if config is None else config)
    return tuple(judge_view(spec, detector, cache=cache) for spec in specs)


def run_views(
    specs: Sequence[ViewSpec],
    factory: DetectorFactory,
    *,
    config: Config | None = None,
    cache: Path | None = None,
    num_workers: int = 1,
    on_judgements: OnJudgements | None = None,
) -> tuple[FrameJudgement, ...]:
    """Judge one detector on views, shared out among processes; judgements come in the order of the specs.

    Parameters
    ----------
    specs
        The views.
    factory, config
        Make the detector.
    cache
        See ``load_view``.
    num_workers
        Number of processes; with one the views are judged in this process.
    on_judgements
        Called with each part as it comes in.
    """
    parts = [specs[start : start + VIEWS_PER_TASK] for start in range(0, len(specs), VIEWS_PER_TASK)]
    judgements: list[FrameJudgement] = []

    def keep(found: tuple[FrameJudgement, ...]) -> None:
        judgements.extend(found)
        if on_judgements is not None:
            on_judgements(found)

    if num_workers == 1:
        for part in parts:
            keep(judge_views(part, factory, config=config, cache=cache))
        return tuple(judgements)
    with make_worker_pool(num_workers) as pool:
        futures = [pool.submit(judge_views, part, factory, config=config, cache=cache) for part in parts]
        for future in futures:
            keep(future.result())
    return tuple(judgements)
