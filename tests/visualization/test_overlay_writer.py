"""Pictures drawn in the background are written in order, all of them, and no more than a few wait."""

from __future__ import annotations

import threading

import cv2
import numpy as np
import pytest

from stairmap.camera import PinholeCamera
from stairmap.detection.observation import Detection
from stairmap.errors import OutputError
from stairmap.frame import DepthFrame
from stairmap.visualization.overlay import draw_detection
from stairmap.visualization.overlay_writer import MAX_WAITING, OverlayWriter

CAMERA = PinholeCamera(width=40, height=30, fx=30.0, fy=30.0, cx=20.0, cy=15.0)


def frame_at(depth: float) -> DepthFrame:
    image = np.full((30, 40), depth, dtype=np.float32)
    image[:, :20] *= 1.5
    return DepthFrame(stamp_ns=int(depth * 1e9), depth=image, camera=CAMERA)


def test_pictures_are_those_of_their_frames_in_order() -> None:
    written: list[tuple[int, bytes]] = []
    threads = set()

    def write(number: int, png: bytes) -> None:
        written.append((number, png))
        threads.add(threading.current_thread())

    nothing = Detection(stamp_ns=0, observations=(), rejections=())
    with OverlayWriter(write) as overlays:
        for number in range(3 * MAX_WAITING):
            overlays.add(number, frame_at(1.0 + number), nothing)
            assert number + 1 - len(written) <= MAX_WAITING
    assert [number for number, _ in written] == list(range(3 * MAX_WAITING))
    assert threads == {threading.current_thread()}
    for number, png in written[::7]:
        picture = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
        np.testing.assert_array_equal(picture, draw_detection(frame_at(1.0 + number), nothing))


def test_a_picture_that_cannot_be_written_ends_the_work() -> None:
    def write(number: int, png: bytes) -> None:
        raise OutputError(f"no room for picture {number}")

    nothing = Detection(stamp_ns=0, observations=(), rejections=())
    with pytest.raises(OutputError, match="no room for picture 0"), OverlayWriter(write) as overlays:
        overlays.add(0, frame_at(1.0), nothing)
