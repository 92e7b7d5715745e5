"""Keeps the node's map in its file: goes on from there, writes it when it has changed, and on demand. No ROS
in here."""

from __future__ import annotations

from pathlib import Path

from stairmap_ros.live_map import LiveMap
from stairmap_ros.map_file import check_map_file, load_map, save_map
from stairmap_ros.map_file_lock import MapFileError, MapFileLock


class MapKeeper:
    """The map file of one node.

    Parameters
    ----------
    live_map
        What is kept.
    file
        The parameter ``map_file``; empty: none.
    map_frame
        Coordinate frame of the map.

    Raises
    ------
    StairmapError
        If the file cannot be used, another node uses it, or the method cannot be kept.
    """

    def __init__(self, live_map: LiveMap, *, file: str, map_frame: str) -> None:
        self._live_map, self._map_frame = live_map, map_frame
        self._path = check_map_file(file)
        self._lock = None
        if self._path is not None:
            live_map.snapshot()  # of a method that cannot be kept: better now than after an hour
            self._lock = MapFileLock(self._path)
        self._saved_version = live_map.version

    def go_on(self) -> str:
        """Go on from the file, if there is one; return what was done.

        Raises
        ------
        MapFileError
            If it holds no map.
        """
        if self._path is None:
            return "a new map; without map_file it is forgotten at the end"
        if not self._path.exists():
            return f"new map, to be kept in {self._path}"
        return f"goes on from {self._load(self._path)}"

    def save_changed(self) -> None:
        """Write the file if the map has changed.

        Raises
        ------
        StairmapError
            If it cannot be written.
        """
        if self._path is not None and self._live_map.version != self._saved_version:
            self._save(self._path)

    def save(self, file: str) -> str:
        """Write the map to a file, empty for ``map_file``; return what was done.

        Raises
        ------
        StairmapError
            If it cannot be written.
        """
        path = self._named_path(file)
        num_images = self._save(path)
        return f"{num_images} images written to {path}"

    def load(self, file: str) -> str:
        """Take the map of a file, empty for ``map_file``, instead of the one there is; return what was done.

        Raises
        ------
        MapFileError
            If it holds no map.
        """
        path = self._named_path(file)
        if not path.exists():
            raise MapFileError(f"there is no map file {path}")
        return f"loaded {self._load(path)}"

    def close(self) -> None:
        """Let another node have the file."""
        if self._lock is not None:
            self._lock.release()

    def _named_path(self, file: str) -> Path:
        path = check_map_file(file) or self._path
        if path is None:
            raise MapFileError(
                "no file is named, and the parameter map_file is empty; name a file (NAME.npz)"
            )
        return path

    def _save(self, path: Path) -> int:
        version = self._live_map.version
        snapshot = self._live_map.snapshot()
        save_map(path, snapshot, map_frame=self._map_frame)
        if path == self._path:
            self._saved_version = version
        return len(snapshot.stamps_ns)

    def _load(self, path: Path) -> str:
        stairway_map = self._live_map.new_map()
        num_images = load_map(path, stairway_map, map_frame=self._map_frame)
        num_stairways = len(stairway_map.stairways())
        self._live_map.replace(stairway_map)
        if path == self._path:
            self._saved_version = self._live_map.version
        return f"{path}: {num_images} images, {num_stairways} stairways"
