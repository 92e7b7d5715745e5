"""What an exploring robot decided, for people and programs: the log, ``~/decisions``, and files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

from stairmap.errors import OutputError
from stairmap.exploration.known_building import KnownBuilding
from stairmap.exploration.mission_folder import DECISIONS_FILE
from stairmap.export.results import create_run_folder, null_for_nan
from stairmap.navigation.occupancy import MapError, dump_map

LATCHED = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Whoever comes later hears the last thousand entries."""


class MissionRecord:
    """Keeps decisions and events as JSON lines, and maps at the end.

    Parameters
    ----------
    node
        Whose log and topic these are.
    output
        Folder; empty: no files.

    Raises
    ------
    OutputError
        If the folder holds something already or cannot be made.
    """

    def __init__(self, node: Node, output: str) -> None:
        self._node = node
        self._out = node.create_publisher(String, "~/decisions", LATCHED)
        self._folder = create_run_folder(Path(output), "explorer") if output else None
        if self._folder is not None:
            self._folder.on_failure = self._node.get_logger().error

    def write(self, entry: dict[str, Any]) -> None:
        """Take in a decision or an event."""
        self._out.publish(String(data=json.dumps(null_for_nan(entry))))
        self._node.get_logger().info(describe_entry(entry))
        if self._folder is not None:
            self._folder.append_json(DECISIONS_FILE, entry)

    def close(self, known: KnownBuilding) -> None:
        """Write the map of each level as nav2_map_server reads it, and end the files."""
        if self._folder is None:
            return
        try:
            self._folder.release_reserve()
            for level in known.levels.levels:
                if level.map.trail.size:
                    dump_map(level.map.grid(), self._folder.path / "maps", f"level_{level.number}")
            self._folder.close()
        except (MapError, OutputError) as error:
            self._node.get_logger().error(str(error))


def describe_entry(entry: dict[str, Any]) -> str:
    """Return an entry of ``decisions.jsonl`` as a line for people."""
    if entry["event"] != "decision":
        rest = {name: value for name, value in entry.items() if name not in ("event", "time_s")}
        return f"{entry['event']}: " + ", ".join(f"{name} {value}" for name, value in rest.items())
    chosen, num = entry["chosen"], len(entry["tasks"])
    where = f"level {entry['level']}, {entry['place'][0]:.2f}, {entry['place'][1]:.2f}"
    if chosen is None:
        return f"{where}: nothing to do is left of {num} tasks"
    what = f"{chosen['kind']} at {chosen['target'][0]:.2f}, {chosen['target'][1]:.2f}"
    reason = f" ({chosen['reason']})" if chosen["reason"] else ""
    return (
        f"{where}: {what}{reason}, cost {chosen['cost']:.1f} s, gain {chosen['gain']:.1f} m², of {num} tasks"
    )
