"""What commands were asked for, as values that cost nothing to import."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from stairmap.recordings.bag_options import BagOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodRequest:
    """Which method looks at which recording.

    Attributes
    ----------
    recording
        Path of the recording.
    trajectory
        File with poses to use instead of its own.
    up
        Axis of the map that points up, or ``auto``; see ``open_recording``.
    pose_format
        How the poses are written; see ``open_recording``.
    method
        A key of ``stairmap.pipeline.METHODS``.
    config_file, overrides
        See ``load_config``.
    bag
        What to take of a bag.
    """

    recording: Path
    trajectory: Path | None = None
    up: str | None = None
    pose_format: str | None = None
    method: str = "stairmap"
    config_file: Path | None = None
    overrides: tuple[str, ...] = ()
    bag: BagOptions = field(default_factory=BagOptions)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRequest:
    """What ``stairmap run`` was asked for."""

    input: MethodRequest
    output: Path | None
    with_report: bool
    as_json: bool
    robots: tuple[str, ...] = ()
    with_view: bool = False
    with_odometry: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchRequest:
    """What ``stairmap batch`` was asked for.

    Attributes
    ----------
    recordings
        Paths, folders, globs, addresses and ``@`` lists.
    output
        Folder or address.
    num_workers
        Processes on this machine; ``None``: one a core, 0: one without dask.
    scheduler
        Address of a dask scheduler instead.
    memory_limit
        Of each process on this machine, such as ``4GiB``, or ``auto``.
    robots
        Profiles.
    with_reports
        Whether each run folder gets a ``report.html``.
    with_odometry, up, pose_format, bag, method, config_file, overrides
        As in ``RunRequest``.
    """

    recordings: tuple[str, ...]
    output: str
    num_workers: int | None
    scheduler: str | None
    memory_limit: str
    robots: tuple[str, ...]
    with_reports: bool
    with_odometry: bool
    up: str | None
    pose_format: str | None
    bag: BagOptions
    method: str
    config_file: Path | None
    overrides: tuple[str, ...]
    as_json: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanRequest:
    """What ``stairmap scan`` was asked for; ``up`` and ``unit`` are found from the points where not given."""

    files: tuple[Path, ...]
    up: str | None
    unit: str | None
    config_file: Path | None
    overrides: tuple[str, ...]
    output: Path | None
    with_report: bool
    as_json: bool
    robots: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class MergeRequest:
    """What ``stairmap merge`` was asked for; ``alignment`` is a file, or ``auto``."""

    runs: tuple[Path, ...]
    alignment: str
    output: Path | None
    as_json: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class CleanRequest:
    """What ``stairmap clean`` was asked for; without a run the map is scanned first."""

    files: tuple[Path, ...]
    output: Path
    run: Path | None
    up: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchmarkRequest:
    """What ``stairmap benchmark`` was asked for; programs are names and commands, the timeout is in s."""

    programs: tuple[tuple[str, str], ...]
    with_own: bool
    timeout: float
    num_frames: int
    num_drives: int
    num_clouds: int
    seed: int
    as_json: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveRequest:
    """What ``stairmap live`` was asked for; without a number of frames, until Ctrl-C."""

    serial: str | None
    playback: Path | None
    num_frames: int | None
    with_odometry: bool
    method: str
    config_file: Path | None
    overrides: tuple[str, ...]
    record: Path | None
    output: Path | None


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectRequest:
    """What ``stairmap detect`` was asked for."""

    input: MethodRequest
    output: Path | None
    with_overlays: bool
    as_json: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class InspectRequest:
    """What ``stairmap inspect`` was asked for; without a frame's number, the whole recording."""

    input: MethodRequest
    frame_number: int | None
    output: Path | None
    as_json: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulateRequest:
    """What ``stairmap simulate`` was asked for; without a number of frames, at the robot's speed."""

    scene: str
    output: Path | None
    sensor: str
    robot: str
    factor: float
    seed: int
    num_frames: int | None
    has_odometry_error: bool
    buildings: Path | None


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckRequest:
    """What ``stairmap check`` was asked for; without robots and codes, all robots."""

    stairways: Path
    robots: tuple[str, ...]
    codes: tuple[str, ...]
    picture: Path | None
    as_json: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportRequest:
    """What ``stairmap export`` was asked for; ``anchor`` is latitude, longitude, bearing, deg, and height, m.

    ``maps`` are levels and files; without them and ``recording``, the run says where its recording is.
    """

    run: Path
    formats: tuple[str, ...]
    output: Path
    robot: str | None
    anchor: tuple[float, float, float, float | None] | None
    recording: Path | None = None
    maps: tuple[tuple[int, Path], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRequest:
    """What ``stairmap plan`` was asked for; places are x, y in m and a level.

    Attributes
    ----------
    run
        Run folder.
    maps
        Nav2 map files by level.
    recording
        Recording of the run, for floors without such a file.
    robot
        Profile.
    start, goal
        Without a goal, the places to explore from are asked for.
    allow_unknown
        Whether stairs with an unknown verdict may be used.
    camera_height
        Above the floor, m; needed only without a stairway.
    output
        New folder for maps, route and picture.
    """

    run: Path
    maps: tuple[tuple[int, Path], ...]
    recording: Path | None
    robot: str
    start: tuple[float, float, int] | None
    goal: tuple[float, float, int] | None
    allow_unknown: bool
    camera_height: float | None
    output: Path | None
    as_json: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewRequest:
    """What ``stairmap view`` was asked for.

    Attributes
    ----------
    run
        Run folder.
    recording
        Where its recording is now; ``None``: where it was.
    every
        Show each N-th frame only.
    rrd, page, mcap
        Files to write for rerun, browsers and Foxglove.
    web_port
        Port of 127.0.0.1 to serve the rerun viewer at.
    """

    run: Path
    recording: Path | None = None
    every: int = 1
    rrd: Path | None = None
    web_port: int | None = None
    page: Path | None = None
    mcap: Path | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ExploreRequest:
    """What ``stairmap explore`` was asked for; ``start`` is x, y, z (m) and yaw (deg), or found, or that of
    the mission in the folder ``resume``."""

    world: str
    robot: str
    start: tuple[float, float, float, float] | None
    buildings: Path | None
    seed: int
    has_perfect_odometry: bool
    strategy: str
    allow_unknown: bool
    output: Path | None
    resume: Path | None
    with_report: bool
    as_json: bool
