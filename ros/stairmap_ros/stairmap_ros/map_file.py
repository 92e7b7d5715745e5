"""The map on disk: what the modeler knows, and from where it was seen; written whole or not at all.

``NAME.npz`` is what a restarted node goes on from; ``NAME.json`` beside it is an ordinary
``stairways.json``, for ``stairmap check``, ``plan`` and ``export``. No ROS in here.
"""

from __future__ import annotations

import json
import os
import zipfile
from pathlib import Path

import numpy as np

import stairmap
from stairmap.errors import StairmapError, TrajectoryError
from stairmap.export.results import SCHEMA as STAIRWAYS_SCHEMA
from stairmap.export.results import null_for_nan
from stairmap.modeling.mapper import MapperState
from stairmap.session import MapSessionState
from stairmap.stairway import Stairway
from stairmap_ros.stairway_map import MapSnapshot, StairwayMap
from stairmap_ros.viewpoints import index_stamps_ns

SCHEMA = 2
"""Version of the file that is written."""

READABLE_SCHEMAS = (1, 2)
"""Versions that are read; 1 knows no looks, overhang and deviations of single steps."""


class MapFileError(StairmapError):
    """The map file cannot be read or written."""


def check_map_file(text: str) -> Path | None:
    """Return the path of the parameter ``map_file``; ``None`` for none.

    Raises
    ------
    MapFileError
        If it does not end in .npz, or its folder is not there.
    """
    if not text:
        return None
    path = Path(text).expanduser()
    if path.suffix != ".npz":
        raise MapFileError(f"map_file must end in .npz, got '{text}'")
    if not path.parent.is_dir():
        raise MapFileError(f"the folder of map_file {path} is not there; make it: mkdir -p {path.parent}")
    return path


def load_map(path: Path, stairway_map: StairwayMap, *, map_frame: str) -> int:
    """Let a map go on from a file; return the number of its images, 0 if there is no file yet.

    Raises
    ------
    MapFileError
        If the file is damaged, of another version, or made in another coordinate frame.
    """
    if not path.exists():
        return 0
    try:
        with np.load(path, allow_pickle=False) as arrays:
            schema, saved_frame = int(arrays["schema"]), str(arrays["map_frame"])
            if schema not in READABLE_SCHEMAS:
                known = " and ".join(str(readable) for readable in READABLE_SCHEMAS)
                raise MapFileError(
                    f"map_file {path} has schema {schema}, this node reads {known}; name another map_file"
                )
            if saved_frame != map_frame:
                raise MapFileError(
                    f"map_file {path} was made in the coordinate frame '{saved_frame}', map_frame is now "
                    f"'{map_frame}'; name another map_file"
                )
            modeler = MapperState(
                observations=arrays["observations"],
                edges=arrays["edges"],
                ids=arrays["ids"],
                next_id=int(arrays["next_id"]),
                **({"looks": arrays["looks"]} if schema > 1 else {}),
            )
            poses = arrays["map_from_camera"]
            state = MapSessionState(
                modeler=modeler, stamps_ns=index_stamps_ns(len(poses)), map_from_camera=poses
            )
            snapshot = MapSnapshot(state=state, stamps_ns=arrays["stamps_ns"])
        stairway_map.restore(snapshot)
    except (
        OSError, EOFError, KeyError, ValueError, TypeError, RuntimeError, zipfile.BadZipFile, TrajectoryError
    ) as error:  # fmt: skip
        raise MapFileError(
            f"cannot go on from map_file {path}: {error}; move it away to start anew"
        ) from error
    return len(snapshot.stamps_ns)


def save_map(path: Path, snapshot: MapSnapshot, *, map_frame: str) -> None:
    """Write a map so that at any moment the old or the new file is there, whole.

    Raises
    ------
    MapFileError
        If it cannot be written.
    """
    state = snapshot.state.modeler
    try:
        new = path.with_suffix(".npz.new")
        with new.open("wb") as file:
            np.savez(
                file,
                schema=SCHEMA,
                map_frame=map_frame,
                observations=state.observations,
                edges=state.edges,
                ids=state.ids,
                next_id=state.next_id,
                looks=state.looks,
                stamps_ns=snapshot.stamps_ns,
                map_from_camera=snapshot.state.map_from_camera,
            )
            os.fsync(file.fileno())
        new.replace(path)
        text = _stairways_json(snapshot.stairways, len(snapshot.stamps_ns), map_frame)
        new = path.with_suffix(".json.new")
        new.write_text(text, encoding="utf-8")
        new.replace(path.with_suffix(".json"))
    except OSError as error:
        raise MapFileError(f"cannot write map_file {path}: {error.strerror}") from error


def _stairways_json(stairways: tuple[Stairway, ...], num_frames: int, map_frame: str) -> str:
    values = {
        "schema": STAIRWAYS_SCHEMA,
        "software": f"stairmap {stairmap.__version__}",
        "frame_id": map_frame,
        "num_frames": num_frames,
        "stairways": [stairway.to_dict() for stairway in stairways],
    }
    return json.dumps(null_for_nan(values), indent=1, allow_nan=False) + "\n"
