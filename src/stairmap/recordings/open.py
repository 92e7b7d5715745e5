"""Open whatever a path holds as a recording, or say what was expected."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from stairmap.errors import MissingPackageError, RecordingError
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.base import Recording, WatchOpening
from stairmap.recordings.clouds.open import CLOUD_SUFFIXES
from stairmap.recordings.depth_files import is_organised_name
from stairmap.recordings.image_folder import CAMERA_FILE, DEPTH_LIST, ImageFolderRecording

if TYPE_CHECKING:
    from stairmap.recordings.bags.elevation import ElevationRecording
    from stairmap.recordings.bags.stream import BagTopic
    from stairmap.recordings.bags.sweeps import SweepRecording

_FOLDER_PARTS = (
    f"a bag (.bag, .mcap, .db3), or a folder with {DEPTH_LIST}, {CAMERA_FILE} and depth images "
    "(docs/inputs.md)"
)

_UNSUPPORTED_FILES = {
    ".svo": "ZED recordings",
    ".svo2": "ZED recordings",
    ".mkv": "videos",
    ".zip": "archives",
    ".tgz": "archives",
    ".gz": "archives",
    ".xz": "archives",
}


def open_recording(
    path: Path,
    *,
    trajectory: Path | None = None,
    up: str | None = None,
    pose_format: str | None = None,
    bag: BagOptions | None = None,
    watch: WatchOpening | None = None,
) -> Recording:
    """Open a recording.

    Parameters
    ----------
    path
        An image folder; a bag of ROS 1, ROS 2 or the RealSense recorder; or an organised cloud of a depth
        camera (``.pcd``), a recording of one frame.
    trajectory
        Poses of the camera's optical coordinate frame (TUM format) to use instead of the recording's own.
    up
        Which axis of the poses' coordinate frame points up: ``+x -x +y -y +z -z``, ``+z`` if not given.
        ``auto`` leaves the poses as they are and frames without ``up``, so that it is found from the floor.
    pose_format
        How the poses are written, if not as ``map_from_camera`` of the optical frame, x y z w, in metres:
        names of ``POSE_FORMATS`` joined by commas.
    bag
        Which topics and frames of a bag to use, where that is not clear by itself.
    watch
        Called with the progress of opening a bag, which may take a second per gigabyte.

    Raises
    ------
    RecordingError
        If the path is no recording, or a broken one; also as CalibrationError for the camera file and
        TrajectoryError for the poses. The message says what was expected, what came, and what to do.
    """
    path = Path(path)
    options = bag or BagOptions()
    try:
        is_cloud = path.is_file() and is_organised_name(path.name)
        if is_cloud or (path.is_dir() and (path / DEPTH_LIST).exists()):
            camera = options.camera_file if is_cloud else None
            if options != BagOptions(camera_file=camera):
                what = "a cloud" if is_cloud else "a folder"
                raise RecordingError(f"topics and coordinate frames are those of bags, but {path} is {what}")
            return ImageFolderRecording(
                path, camera=camera, trajectory=trajectory, up=up, pose_format=pose_format
            )
        if path.exists():
            return _open_bag(
                path, trajectory=trajectory, up=up, pose_format=pose_format, options=options, watch=watch
            )
    except OSError as error:
        raise RecordingError(f"cannot open {path}: {error.strerror}") from error
    raise RecordingError(f"expected a recording, but there is no {path}; check the path")


def open_sweeps(
    path: Path,
    *,
    trajectory: Path | None = None,
    up: str | None = None,
    pose_format: str | None = None,
    bag: BagOptions | None = None,
    watch: WatchOpening | None = None,
) -> SweepRecording | ElevationRecording:
    """Open the sweeps of a LiDAR, or a robot's elevation maps, in a bag; see ``open_recording``."""
    _check_rosbags()
    from stairmap.recordings.bags.bag import METADATA, Bag, is_bag  # noqa: PLC0415
    from stairmap.recordings.bags.elevation import ElevationRecording  # noqa: PLC0415
    from stairmap.recordings.bags.grid_message import GRID_MAP  # noqa: PLC0415
    from stairmap.recordings.bags.sweeps import SweepRecording  # noqa: PLC0415

    path, options = Path(path), bag or BagOptions()
    try:
        if not path.exists():
            raise RecordingError(f"expected a bag, but there is no {path}; check the path")
        if not is_bag(path):
            raise RecordingError(
                f"expected a bag with sweeps of a LiDAR (.bag, .mcap, .db3), but {path} is not one"
            )
        if trajectory is not None and (options.pose_topic or options.map_frame):
            raise RecordingError("--trajectory gives all poses; leave --pose-topic and --map-frame out")
        folder = path.parent if path.name == METADATA else path
        if _is_elevation(Bag(folder).topics, options.cloud_topic, GRID_MAP):
            if trajectory is not None or pose_format is not None or options.pose_topic or options.map_frame:
                raise RecordingError(
                    "an elevation map says itself where it lies; leave --trajectory, --pose-format, "
                    "--pose-topic and --map-frame out"
                )
            return ElevationRecording(folder, up=up, options=options)
        return SweepRecording(
            folder, trajectory=trajectory, up=up, pose_format=pose_format, options=options, watch=watch
        )
    except OSError as error:
        raise RecordingError(f"cannot open {path}: {error.strerror}") from error


def _is_elevation(topics: Sequence[BagTopic], wanted: str | None, kind: str) -> bool:
    """Whether the topic that is wanted, or all that there are, are elevation maps."""
    from stairmap.recordings.bags.topics import CLOUDS, topics_of_type  # noqa: PLC0415

    grids = topics_of_type(topics, kind)
    if wanted is None:
        return bool(grids) and not topics_of_type(topics, *CLOUDS)
    return any(wanted.partition(":")[0].lstrip("/") == topic.name.lstrip("/") for topic in grids)


def has_only_sweeps(path: Path) -> bool:
    """Tell whether a path is a bag with sweeps of a LiDAR or elevation maps, and without depth images."""
    from stairmap.recordings.bags.bag import Bag, is_bag  # noqa: PLC0415
    from stairmap.recordings.bags.depth import peek_encodings  # noqa: PLC0415
    from stairmap.recordings.bags.grid_message import GRID_MAP  # noqa: PLC0415
    from stairmap.recordings.bags.topics import CLOUDS, has_depth_topic, topics_of_type  # noqa: PLC0415

    path = Path(path)
    try:
        if not path.exists() or (path / DEPTH_LIST).exists() or not is_bag(path):
            return False
        found = Bag(path)
        if not topics_of_type(found.topics, *CLOUDS, GRID_MAP):
            return False
        return not has_depth_topic(found.topics, peek_encodings(found))
    # Whatever is wrong with it is said by whoever opens it.
    except (RecordingError, OSError):
        return False


def _open_bag(
    path: Path,
    *,
    trajectory: Path | None,
    up: str | None,
    pose_format: str | None,
    options: BagOptions,
    watch: WatchOpening | None,
) -> Recording:
    _check_rosbags()
    # The readers of bags take a tenth of a second to load, which an image folder need not wait for.
    from stairmap.recordings.bags.bag import METADATA, is_bag  # noqa: PLC0415
    from stairmap.recordings.bags.recording import BagRecording  # noqa: PLC0415

    if not is_bag(path):
        raise RecordingError(_describe_folder(path) if path.is_dir() else _describe_file(path))
    if trajectory is not None and (options.pose_topic or options.map_frame):
        raise RecordingError("--trajectory gives all poses; leave --pose-topic and --map-frame out")
    folder = path.parent if path.name == METADATA else path
    return BagRecording(
        folder, trajectory=trajectory, up=up, pose_format=pose_format, options=options, watch=watch
    )


def _check_rosbags() -> None:
    """Say what is missing where only the core was installed, as a ROS workspace does."""
    try:
        import rosbags  # noqa: F401, PLC0415
    except ImportError as error:
        raise MissingPackageError("rosbags", "bags", "reading a bag") from error


def _describe_file(path: Path) -> str:
    kind = _UNSUPPORTED_FILES.get(path.suffix.lower())
    if kind is not None:
        return f"{path}: {kind} are not supported yet; expected {_FOLDER_PARTS}"
    if (path.parent / DEPTH_LIST).exists():
        return f"expected a folder, but {path} is a file; pass {path.parent}"
    if path.suffix.lower() in CLOUD_SUFFIXES:
        return f"expected a recording, but {path} may hold points; stairmap scan finds stairs in those"
    return f"expected {_FOLDER_PARTS}, but {path} is a file"


def _describe_folder(path: Path) -> str:
    contents = sorted(path.iterdir())
    inner = next((folder for folder in contents if (folder / DEPTH_LIST).exists()), None)
    if inner is not None:
        return f"{path} has no {DEPTH_LIST}, but its folder {inner.name} has; pass {inner}"
    names = ", ".join(file.name for file in contents[:5])
    found = f"holds only {names}{' …' if len(contents) > 5 else ''}" if contents else "is empty"
    return f"expected {_FOLDER_PARTS}, but {path} {found}; list the images in {DEPTH_LIST}: stamp_s filename"
