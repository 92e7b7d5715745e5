"""Live depth of a RealSense camera, or of a file of its recorder played at its own speed.

Only the newest frame is ever looked at: whoever is slower than the camera skips frames and never
falls behind. The only module that imports pyrealsense2.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.arrays import DepthImage
from stairmap.camera import PinholeCamera
from stairmap.errors import CalibrationError, MissingPackageError, RecordingError
from stairmap.frame import DepthFrame
from stairmap.recordings.accelerometer import UpFilter
from stairmap.recordings.realsense_streams import find_accelerometer, find_depth_stream, rotation_to

MAX_SILENCE = 5.0
"""A camera that sends nothing for so long, s, is gone."""

POLL = 0.1
"""How often the wish to stop is looked at, s."""

MAX_DISTORTION = 1e-6
"""Depth of these cameras is rectified; other lens coefficients than zero cannot be used."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveFrame:
    """The newest frame of a camera.

    Attributes
    ----------
    frame
        Depth, with ``up`` where the camera has an accelerometer.
    num_skipped
        Frames that the camera sent since the one before and that nobody looked at.
    """

    frame: DepthFrame
    num_skipped: int


def open_realsense(*, serial: str | None = None, playback: Path | None = None) -> RealSenseCamera:
    """Open a camera, or a file of the RealSense recorder.

    Parameters
    ----------
    serial
        Serial number; ``None``: the only one.
    playback
        File to play instead.

    Raises
    ------
    MissingPackageError
        Without the package pyrealsense2.
    RecordingError
        If that package cannot be loaded, there is no such camera, or several and none was named; the
        message says which there are.
    """
    library = _library()
    context = library.context()
    if playback is not None:
        if not playback.is_file():
            raise RecordingError(f"expected a file of the RealSense recorder, but there is no {playback}")
        try:
            return RealSenseCamera(context.load_device(str(playback)), name=playback.stem)
        except RuntimeError as error:
            raise RecordingError(f"cannot play {playback}: {error}") from error
    devices = {str(device.get_info(library.camera_info.serial_number)): device for device in context.devices}
    found = ", ".join(devices) or "none"
    if serial is not None and serial not in devices:
        raise RecordingError(f"expected a RealSense camera with serial number {serial}, found: {found}")
    if not devices:
        raise RecordingError(
            "expected a RealSense camera, found none; plug it into a USB 3 port, close programs that use it, "
            "and on Linux install librealsense's udev rules; or play a recording with --playback FILE"
        )
    if serial is None and len(devices) > 1:
        raise RecordingError(f"expected one RealSense camera, found several; pass --serial, one of: {found}")
    return RealSenseCamera(devices[serial or next(iter(devices))])


class RealSenseCamera:
    """Depth of one device.

    Parameters
    ----------
    device
        ``pyrealsense2.device``: a camera, a playback, or a software device.
    name
        Short name for titles; the device's own without it.

    Raises
    ------
    MissingPackageError
        Without the package pyrealsense2.
    RecordingError
        If the device has no depth stream.
    CalibrationError
        If its depth is distorted.
    """

    def __init__(self, device: Any, *, name: str | None = None) -> None:
        self._library = _library()
        self._device = device
        self._name = name
        self._sensor, self._profile = find_depth_stream(device, self._library, name=self.name)
        self._accelerometer = find_accelerometer(device, self._library)
        intrinsics = self._profile.get_intrinsics()
        if any(abs(coefficient) > MAX_DISTORTION for coefficient in intrinsics.coeffs):
            raise CalibrationError(
                f"expected depth without distortion, but {self.name} has lens coefficients "
                f"{[round(value, 4) for value in intrinsics.coeffs]}"
            )
        self._camera = PinholeCamera(
            width=intrinsics.width,
            height=intrinsics.height,
            fx=intrinsics.fx,
            fy=intrinsics.fy,
            cx=intrinsics.ppx,
            cy=intrinsics.ppy,
        )

    @property
    def name(self) -> str:
        """Name of the device or file."""
        if self._name is not None:
            return self._name
        info = self._library.camera_info.name
        return str(self._device.get_info(info)) if self._device.supports(info) else "RealSense"

    @property
    def camera(self) -> PinholeCamera:
        """Intrinsics of the depth stream."""
        return self._camera

    @property
    def rate(self) -> float:
        """Frames per second that the camera sends."""
        return float(self._profile.fps())

    @property
    def depth_unit(self) -> float:
        """Metres per count of the depth images."""
        unit = self._library.option.depth_units
        return float(self._sensor.get_option(unit)) if self._sensor.supports(unit) else 0.001

    @property
    def has_accelerometer(self) -> bool:
        """Whether the camera itself tells up."""
        return self._accelerometer is not None

    def frames(
        self, *, should_stop: Callable[[], bool] = lambda: False, max_silence: float = MAX_SILENCE
    ) -> Iterator[LiveFrame]:
        """Yield the newest frame, again and again, until a recording ends or ``should_stop`` says so.

        Raises
        ------
        RecordingError
            If the camera cannot be started, or sends nothing for ``max_silence`` seconds.
        """
        # A queue of one keeps the newest frame and drops those before it.
        depth_queue = self._library.frame_queue(1)
        accelerations = self._library.frame_queue(64)
        started: list[Any] = []
        try:
            self._start(self._sensor, self._profile, depth_queue, started)
            up = UpFilter()
            if self._accelerometer is not None:
                sensor, profile = self._accelerometer
                self._start(sensor, profile, accelerations, started)
                up = UpFilter(rotation_to(profile, self._profile))
            yield from self._newest(depth_queue, accelerations, up, should_stop, max_silence)
        finally:
            for sensor in reversed(started):
                # A playback that has ended, or a cable that was pulled, has stopped by itself.
                with suppress(RuntimeError):
                    sensor.stop()
                with suppress(RuntimeError):
                    sensor.close()

    def _newest(
        self,
        depth_queue: Any,
        accelerations: Any,
        up: UpFilter,
        should_stop: Callable[[], bool],
        max_silence: float,
    ) -> Iterator[LiveFrame]:
        silence, last_stamp_ns, last_number = 0.0, -(2**63), None
        while not should_stop():
            has_come, image = depth_queue.try_wait_for_frame(round(1000 * POLL))
            while motion := accelerations.poll_for_frame():
                reading = motion.as_motion_frame().get_motion_data()
                up.add(np.array([reading.x, reading.y, reading.z]))
            if not has_come:
                silence += POLL
                if self._has_ended():
                    return
                if silence >= max_silence:
                    raise RecordingError(
                        f"expected depth of {self.name}, but none came for {max_silence:g} s; "
                        "is it still plugged in, and does no other program use it?"
                    )
                continue
            silence = 0.0
            stamp_ns, number = round(image.get_timestamp() * 1e6), int(image.get_frame_number())
            if stamp_ns <= last_stamp_ns:
                continue  # the camera's clock was set back; time goes on when it has caught up
            num_skipped = 0 if last_number is None else max(number - last_number - 1, 0)
            last_stamp_ns, last_number = stamp_ns, number
            depth = depth_from_counts(np.asanyarray(image.get_data()), self.depth_unit)
            frame = DepthFrame(stamp_ns=stamp_ns, depth=depth, camera=self._camera, up=up.value)
            yield LiveFrame(frame=frame, num_skipped=num_skipped)

    def _start(self, sensor: Any, profile: Any, queue: Any, started: list[Any]) -> None:
        try:
            sensor.open(profile)
            started.append(sensor)
            sensor.start(queue)
        except RuntimeError as error:
            raise RecordingError(
                f"cannot start {self.name}: {error}; close other programs that use it, or plug it in again"
            ) from error

    def _has_ended(self) -> bool:
        if not self._device.is_playback():
            return False
        return bool(self._device.as_playback().current_status() == self._library.playback_status.stopped)


def depth_from_counts(counts: np.ndarray[Any, Any], unit: float) -> DepthImage:
    """Return (height, width) depth in m of counts of ``unit`` m; 0 and 65535 are not measured."""
    depth = counts.astype(np.float32) * np.float32(unit)
    depth[(counts == 0) | (counts == 65535)] = np.nan
    return depth


def _library() -> Any:
    try:
        return importlib.import_module("pyrealsense2")
    except ModuleNotFoundError as error:
        raise MissingPackageError(
            "pyrealsense2", "realsense", "a RealSense camera", no_wheel_on=("aarch64",)
        ) from error
    except ImportError as error:
        raise RecordingError(
            f"pyrealsense2 is installed but cannot be loaded: {error}; "
            "on Debian and Ubuntu: apt install libusb-1.0-0"
        ) from error
