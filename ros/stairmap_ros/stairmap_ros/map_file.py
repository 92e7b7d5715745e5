"""The map on disk: what the modeler knows, and from where it was seen; written whole or not at all.

``NAME.npz`` is what a restarted node goes on from; ``NAME.json`` beside it is an ordinary
``stairways.json``, for ``stairmap check``, ``plan`` and ``export``. No ROS in here.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from stairmap.array_files import load_arrays
from stairmap.errors import OutputError, TrajectoryError
from stairmap.export.results import stairways_json
from stairmap.input_files import quoted
from stairmap.modeling.mapper import MapperState
from stairmap.output_files import write_whole, write_whole_text
from stairmap.session import MapSessionState
from stairmap_ros.map_file_lock import MapFileError
from stairmap_ros.stairway_map import MapSnapshot, StairwayMap
from stairmap_ros.viewpoints import index_stamps_ns

SCHEMA = 3
"""Version of the file that is written."""

READABLE_SCHEMAS = (1, 2, 3)
"""Versions that are read; 1 knows no looks, overhang and deviations of single steps, 2 no ground."""


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
        arrays = load_arrays(path, error_type=MapFileError)
        schema, saved_frame = int(arrays["schema"]), str(arrays["map_frame"])
        if schema not in READABLE_SCHEMAS:
            known = " and ".join(str(readable) for readable in READABLE_SCHEMAS)
            raise MapFileError(
                f"map_file {path} has schema {schema}, this node reads {known}; name another map_file"
            )
        if saved_frame != map_frame:
            raise MapFileError(
                f"map_file {path} was made in the coordinate frame {quoted(saved_frame)}, map_frame is now "
                f"'{map_frame}'; name another map_file"
            )
        for name in ("observations", "looks", "ground_views", "ground_edges"):
            if name in arrays and "stamp_ns" not in (arrays[name].dtype.names or ()):
                raise ValueError(f"its {name} are no records with a stamp")
        modeler = MapperState(
            observations=arrays["observations"],
            edges=arrays["edges"],
            ids=arrays["ids"],
            next_id=int(arrays["next_id"]),
            **({"looks": arrays["looks"]} if schema > 1 else {}),
        )
        poses = arrays["map_from_camera"]
        ground = {name: arrays[name] for name in ("ground_views", "ground_edges") if schema > 2}
        state = MapSessionState(
            modeler=modeler, stamps_ns=index_stamps_ns(len(poses)), map_from_camera=poses, **ground
        )
        snapshot = MapSnapshot(state=state, stamps_ns=arrays["stamps_ns"])
        stairway_map.restore(snapshot)
    except KeyError as error:
        raise MapFileError(
            f"cannot go on from map_file {path}: it lacks the array {error}; move it away to start anew"
        ) from error
    except (ValueError, TypeError, RuntimeError, TrajectoryError) as error:
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
    content = io.BytesIO()
    np.savez(
        content,
        schema=SCHEMA,
        map_frame=map_frame,
        observations=state.observations,
        edges=state.edges,
        ids=state.ids,
        next_id=state.next_id,
        looks=state.looks,
        ground_views=snapshot.state.ground_views,
        ground_edges=snapshot.state.ground_edges,
        stamps_ns=snapshot.stamps_ns,
        map_from_camera=snapshot.state.map_from_camera,
    )
    text = stairways_json(
        snapshot.answer.stairways,
        num_frames=len(snapshot.stamps_ns),
        frame_id=map_frame,
        drops=snapshot.answer.drops,
        camera_height=snapshot.answer.camera_height,
    )
    try:
        write_whole(path, content.getvalue())
        write_whole_text(path.with_suffix(".json"), text)
    except OutputError as error:
        raise MapFileError(f"map_file: {error}") from error
