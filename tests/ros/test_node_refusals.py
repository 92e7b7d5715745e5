"""What the node cannot do, it says in one line and ends."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from ros_environment import RosEnvironment, wait_for

pytestmark = pytest.mark.usefixtures("wheels")

IMPOSSIBLE: dict[str, dict[str, Any]] = {
    "parameter reliability: Input should be 'best_effort' or 'reliable'": {"reliability": "sometimes"},
    "parameter detection.max_depth: Input should be less than or equal": {"detection.max_depth": 50},
    "the folder of map_file /nowhere/hall.npz is not there": {"map_file": "/nowhere/hall.npz"},
    "map_file must end in .npz": {"map_file": "hall.yaml"},
    "map_file needs method: stairmap": {"map_file": "hall.npz", "method": "delmerico2013"},
    "there is no parameter max_transform_wiat; did you mean max_transform_wait?": {"max_transform_wiat": 1.0},
    "there is no parameter detection.max_dept; did you mean detection.max_depth?": {
        "detection.max_dept": 4.0
    },
}


def test_what_is_impossible_ends_the_node_with_one_line(ros: RosEnvironment) -> None:
    """All at once: starting a node takes a second of processor time."""
    nodes = {
        told: ros.start_node(name=f"node_{number}", **parameters)
        for number, (told, parameters) in enumerate(IMPOSSIBLE.items())
    }
    unreadable = ros.start_node(name="unreadable", map_frame="")
    without = ros.start_node(name="without_tf2", without_package="tf2_msgs")
    for number, (told, node) in enumerate(nodes.items()):
        assert node.wait(timeout=120) == 1, told
        assert only_line_of(ros, f"node_{number}").startswith(f"stairmap: {told}")
    assert unreadable.wait(timeout=60) == 1
    last = ros.log_of("unreadable").read_text().splitlines()[-1]
    assert last.startswith("stairmap: failed to initialize rcl: Couldn't parse parameter override rule")
    assert without.wait(timeout=60) == 1
    line = only_line_of(ros, "without_tf2")
    assert line.startswith("stairmap: tf2_msgs is not installed")
    assert line.endswith("sudo apt install ros-$ROS_DISTRO-tf2-msgs")


def test_two_nodes_do_not_share_a_map_file(ros: RosEnvironment, tmp_path: Path) -> None:
    map_file = tmp_path / "hall.npz"
    first = ros.start_node(name="first", map_file=map_file)
    assert wait_for(lambda: "new map, to be kept in" in ros.log_of("first").read_text(), seconds=60)
    second = ros.start_node(name="second", map_file=map_file)
    assert second.wait(timeout=60) == 1
    assert only_line_of(ros, "second") == (
        f"stairmap: map_file {map_file} is in use by process {first.pid}; end that node, or name another "
        "map_file"
    )
    first.kill()
    first.wait()
    ros.start_node(name="third", map_file=map_file)
    assert wait_for(lambda: "new map, to be kept in" in ros.log_of("third").read_text(), seconds=60)


def only_line_of(ros: RosEnvironment, name: str) -> str:
    """What a node has printed, without what Fast DDS has to say about itself."""
    lines = ros.log_of(name).read_text().splitlines()
    (line,) = [line for line in lines if "[rmw_fastrtps_shared_cpp]" not in line]
    return line
