"""The map that several threads use: what one of them does while another looks at an image."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Transform
from stairmap.camera import PinholeCamera
from stairmap.config import Config
from stairmap.detection.observation import Detection
from stairmap.frame import DepthFrame
from stairmap_ros.live_map import LiveMap, PlacedDepth
from stairmap_ros.stairway_map import StairwayMap

CAMERA = PinholeCamera(width=8, height=8, fx=8.0, fy=8.0, cx=3.5, cy=3.5)


class InterruptedMap(StairwayMap):
    """Lets something happen while an image is looked at."""

    live_map: LiveMap | None = None

    def detect(self, frame: DepthFrame, map_from_camera: Transform) -> Detection:
        if self.live_map is not None:
            self.live_map.forget_way()
            self.live_map = None
        return Detection(stamp_ns=frame.stamp_ns, observations=(), rejections=())


def image(stamp_ns: int) -> PlacedDepth:
    depth = np.full((8, 8), np.nan, dtype=np.float32)
    return PlacedDepth(
        depth=depth, camera=CAMERA, stamp_ns=stamp_ns, map_from_camera=np.eye(4), map_from_body=np.eye(4)
    )


def test_an_image_of_before_a_jump_in_time_is_not_the_newest_after_it() -> None:
    interrupted = InterruptedMap(Config(), method="stairmap", views_per_place=10)
    stamps: list[int] = []
    live_map = LiveMap(lambda: interrupted, lambda _, stamp_ns: stamps.append(stamp_ns))
    interrupted.live_map = live_map
    live_map.look(image(100_000_000_000))
    live_map.look(image(1_000_000_000))
    assert stamps == [0, 1_000_000_000]
