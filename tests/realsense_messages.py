"""What the recorder of RealSense cameras writes as a ROS 1 bag, for tests."""

from __future__ import annotations

import numpy as np

from bag_files import Messages, Ros
from stairmap.recordings.image_folder import ImageFolderRecording

SENSOR = "/device_0/sensor_0"


def ros1_messages(
    ros: Ros, walk: ImageFolderRecording, *, depth_unit: float, option: str = "Depth_Units"
) -> Messages:
    """What the recorder writes as a ROS 1 bag; the unit of depth in metres."""
    unit = ros.make("std_msgs/msg/Float32", data=depth_unit)
    messages: Messages = [(1, f"{SENSOR}/option/{option}/value", unit)]
    for name, topic in (("Depth_0", "depth"), ("Infrared_1", "infrared")):
        info = ros.camera_info(walk.camera, 0)
        messages.append((2, f"{SENSOR}/{name}/info/camera_info", info))
        for frame in walk:
            depth = frame.depth * np.float32(0.001 / depth_unit)
            image = ros.image(depth, frame.stamp_ns, encoding="mono16", frame_id="0")
            if topic == "infrared":
                image.encoding, image.step = "mono8", walk.camera.width
                image.data = image.data[::2]
            messages.append((frame.stamp_ns + 10, f"{SENSOR}/{name}/image/data", image))
    return messages
