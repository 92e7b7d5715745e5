"""Parameters that do not exist are refused with the nearest that does; run by ``colcon test``."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2 with stairmap_msgs built")

from stairmap.errors import ConfigError
from stairmap_ros.parameters import check_known, known_parameters


def test_every_parameter_of_the_file_is_known() -> None:
    assert {"map_frame", "max_transform_gap", "detection.max_depth"} <= set(known_parameters())
    given = [*known_parameters(), "use_sim_time", "qos_overrides./tf.subscription.depth"]
    check_known(given, known_parameters())


def test_a_misspelt_parameter_is_refused_with_the_nearest() -> None:
    with pytest.raises(
        ConfigError, match=r"no parameter max_transform_wiat; did you mean max_transform_wait\?"
    ):
        check_known(["max_transform_wiat"], known_parameters())
