"""The suites without a camera: which maps are made, and which drives are driven with which LiDAR."""

from __future__ import annotations

from pathlib import Path

from stairmap.errors import StairmapError
from stairmap.evaluation.cloud_trials import FINISHED_MAPS, SWEEPS
from stairmap.evaluation.suites import TrialChoice
from stairmap.evaluation.trials import TrialSpec
from stairmap.simulation.finished_maps import MAP_KINDS
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scenes import BUILDING_PREFIX, SCENE_GROUPS

CLOUD_SUITES = (FINISHED_MAPS, SWEEPS)
"""Names of the suites without a camera."""

MAP_GROUPS = ("table1", "stairs", "look-alikes", "kind-drives")
"""Groups of scenes of which finished maps are made, after the buildings."""

SWEEP_GROUPS = ("stairs", "look-alikes")
"""Groups of scenes that are driven with a LiDAR."""

SWEEP_LIDAR = "mid360"
"""The LiDAR of the drives, unless another is asked for: most robots of today carry it."""


def make_cloud_specs(
    suite: str, choice: TrialChoice, *, buildings: Path | None = None
) -> tuple[TrialSpec, ...]:
    """Return the trials of a suite without a camera, none if no scene has such a name.

    Raises
    ------
    StairmapError
        If the buildings are not there.
    """
    specs = _map_specs(choice, buildings) if suite == FINISHED_MAPS else _sweep_specs(choice)
    return tuple(spec for spec in specs if not choice.only or any(word in spec.scene for word in choice.only))


def _map_specs(choice: TrialChoice, buildings: Path | None) -> list[TrialSpec]:
    names = [] if choice.is_quick else _building_names(buildings)
    names += [name for group in MAP_GROUPS for name in SCENE_GROUPS[group]]
    kinds = [choice.sensor] if choice.sensor is not None else list(MAP_KINDS)
    return [
        TrialSpec(suite=FINISHED_MAPS, scene=name, sensor=kind, robot="-", seed=choice.seed)
        for name in names
        for kind in kinds
    ]


def _sweep_specs(choice: TrialChoice) -> list[TrialSpec]:
    robots = list(ROBOTS)
    names = [name for group in SWEEP_GROUPS for name in SCENE_GROUPS[group]]
    return [
        TrialSpec(
            suite=SWEEPS,
            scene=name,
            sensor=choice.sensor or SWEEP_LIDAR,
            robot=choice.robot or robots[(turn + drive + choice.seed) % len(robots)],
            seed=choice.seed + drive,
        )
        for turn, name in enumerate(names)
        for drive in range(1 if choice.is_quick else choice.num_drives or 1)
    ]


def _building_names(buildings: Path | None) -> list[str]:
    if buildings is None or not buildings.is_dir():
        raise StairmapError(
            "suite clouds needs measured meshes of buildings, which are no part of stairmap: a folder "
            "'buildings' with NAME/mesh.ply and NAME/stairs.json (docs/evaluation.md); pass --data DIR, or "
            "--quick to leave them out"
        )
    folders = sorted(path for path in buildings.iterdir() if (path / "stairs.json").exists())
    return [f"{BUILDING_PREFIX}{folder.name}" for folder in folders]
