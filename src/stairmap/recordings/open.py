"""Open whatever a path holds as a recording, or say what was expected."""

from __future__ import annotations

from pathlib import Path

from stairmap.errors import RecordingError
from stairmap.recordings.base import Recording
from stairmap.recordings.image_folder import CAMERA_FILE, DEPTH_LIST, ImageFolderRecording

_FOLDER_PARTS = f"a folder with {DEPTH_LIST}, {CAMERA_FILE} and depth images (docs/inputs.md)"

_UNSUPPORTED_FILES = {
    ".bag": "ROS bags",
    ".db3": "ROS 2 bags",
    ".mcap": "MCAP bags",
    ".pcd": "point clouds",
    ".ply": "point clouds",
    ".svo": "ZED recordings",
    ".svo2": "ZED recordings",
    ".mkv": "videos",
    ".zip": "archives",
    ".tgz": "archives",
    ".gz": "archives",
    ".xz": "archives",
}


def open_recording(path: Path, *, trajectory: Path | None = None, up: str | None = None) -> Recording:
    """Open a recording.

    Parameters
    ----------
    path
        An image folder.
    trajectory
        Poses of the camera's optical coordinate frame (TUM format) to use instead of the recording's own.
    up
        Which axis of the poses' coordinate frame points up: ``+x -x +y -y +z -z``, ``+z`` if not given.
        ``auto`` leaves the poses as they are and the frames without ``up``: the floor tells.

    Raises
    ------
    RecordingError
        If the path is no recording, or a broken one; also as CalibrationError for the camera file and
        TrajectoryError for the poses. The message says what was expected, what came, and what to do.
    """
    path = Path(path)
    try:
        if path.is_dir():
            if (path / DEPTH_LIST).exists():
                return ImageFolderRecording(path, trajectory=trajectory, up=up)
            raise RecordingError(_describe_folder(path))
        if path.exists():
            raise RecordingError(_describe_file(path))
    except OSError as error:
        raise RecordingError(f"cannot open {path}: {error.strerror}") from error
    raise RecordingError(f"expected a recording, but there is no {path}; check the path")


def _describe_file(path: Path) -> str:
    kind = _UNSUPPORTED_FILES.get(path.suffix.lower())
    if kind is not None:
        return f"{path}: {kind} are not supported yet; expected {_FOLDER_PARTS}"
    if (path.parent / DEPTH_LIST).exists():
        return f"expected a folder, but {path} is a file; pass {path.parent}"
    return f"expected {_FOLDER_PARTS}, but {path} is a file"


def _describe_folder(path: Path) -> str:
    contents = sorted(path.iterdir())
    bag = next((file for file in contents if file.suffix in {".db3", ".mcap", ".bag"}), None)
    if bag is not None:
        return _describe_file(bag)
    inner = next((folder for folder in contents if (folder / DEPTH_LIST).exists()), None)
    if inner is not None:
        return f"{path} has no {DEPTH_LIST}, but its folder {inner.name} has; pass {inner}"
    names = ", ".join(file.name for file in contents[:5])
    found = f"holds only {names}{' …' if len(contents) > 5 else ''}" if contents else "is empty"
    return f"expected {_FOLDER_PARTS}, but {path} {found}; list the images in {DEPTH_LIST}: stamp_s filename"
