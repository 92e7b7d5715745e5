"""What the files of the RealSense recorder say in their own way: the unit of depth."""

from __future__ import annotations

import re

from stairmap.recordings.bags.bag import Bag
from stairmap.recordings.depth_message import VALUES_PER_METRE

_SENSOR = re.compile(r"(/device_\d+/sensor_\d+)/")


def is_realsense_topic(name: str) -> bool:
    """Tell whether a topic is one of the RealSense recorder's."""
    return _SENSOR.match(name) is not None


def find_values_per_metre(bag: Bag, depth_topic: str) -> float:
    """Return the scale of 16-bit depth: the sensor's own where the recorder wrote it, else millimetres.

    The option is a number in ROS 1 files and text in ROS 2 files.
    """
    sensor = _SENSOR.match(depth_topic)
    if sensor is None:
        return VALUES_PER_METRE
    names = [f"{sensor.group(1)}/option/{option}/value" for option in ("Depth_Units", "Depth Units")]
    for message in bag.messages(names):
        unit = float(bag.decode(message).data)
        # A unit of 0.001 as float32 is not quite the millimetre that it means.
        return float(f"{1.0 / unit:.6g}") if unit > 0 else VALUES_PER_METRE
    return VALUES_PER_METRE
