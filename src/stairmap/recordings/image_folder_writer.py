"""Write image-folder recordings (docs/inputs.md)."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType

from stairmap.arrays import Transform, Vector
from stairmap.camera import PinholeCamera
from stairmap.errors import OutputError
from stairmap.frame import DepthFrame
from stairmap.output_files import LineLog, keep_lines, write_whole
from stairmap.recordings.camera_file import CameraFile, dump_camera_file
from stairmap.recordings.depth_png import encode_depth_png
from stairmap.recordings.stamped_table import text_from_stamp_ns
from stairmap.recordings.tum_trajectory import TUM_HEADER, tum_line


class ImageFolderWriter:
    """Writes a recording frame by frame; what was written can be read even if the rest never comes.

    Parameters
    ----------
    folder
        Where to write; made if it does not exist.
    camera
        The camera of all frames.
    depth_scale
        PNG values per metre. Depth beyond 65534 of them is written as not measured.
    up
        (3,) direction opposite to gravity, camera frame; only for recordings without poses.
    num_kept
        Go on behind so many frames of a recording that was begun with the same arguments; what is behind
        them is removed. ``None``: begin a new one.

    Raises
    ------
    OutputError
        If the folder of a new recording is not empty, or cannot be written.
    CalibrationError
        If ``depth_scale`` is not positive or ``up`` has no length.
    """

    def __init__(
        self,
        folder: Path,
        camera: PinholeCamera,
        *,
        depth_scale: float = 1000.0,
        up: Vector | None = None,
        num_kept: int | None = None,
    ) -> None:
        self._folder = Path(folder)
        contents = CameraFile(camera=camera, depth_scale=depth_scale, up=up)
        self._camera, self._depth_scale = camera, depth_scale
        self._num_frames, self._last_stamp_ns = 0, -(2**63)
        self._is_closed = False
        self._logs: dict[str, LineLog] = {}
        if num_kept is not None:
            self._keep(num_kept)
            return
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            if any(self._folder.iterdir()):
                raise OutputError(f"expected an empty folder, but {folder} holds files; choose another")
            (self._folder / "depth").mkdir()
            dump_camera_file(self._folder / "camera.json", contents)
            self._append("depth.txt", "# stamp_s filename")
        except OSError as error:
            raise OutputError(f"cannot write the recording {folder}: {error.strerror}") from error

    @property
    def num_frames(self) -> int:
        """Number of frames written so far."""
        return self._num_frames

    def write(self, frame: DepthFrame, map_from_camera: Transform | None = None) -> None:
        """Append one frame.

        Parameters
        ----------
        frame
            Depth image, taken by the recording's camera after the frame before.
        map_from_camera
            (4, 4) pose of the camera's optical coordinate frame; ``None`` where it is not known.

        Raises
        ------
        ValueError
            If the frame has another camera, its stamp does not increase, or the writer is closed.
        OutputError
            If it cannot be written.
        """
        if self._is_closed:
            raise ValueError(f"the recording {self._folder} is closed")
        if frame.camera != self._camera:
            raise ValueError(f"expected frames of {self._camera}, got {frame.camera}")
        if frame.stamp_ns <= self._last_stamp_ns:
            raise ValueError(
                f"expected stamps that increase, got {frame.stamp_ns} ns after {self._last_stamp_ns} ns"
            )
        name = f"depth/{self._num_frames:06d}.png"
        try:
            # The image before its line: an interrupted recording never names a file that is not there.
            write_whole(self._folder / name, encode_depth_png(frame.depth, self._depth_scale), durable=False)
            if map_from_camera is not None:
                if "groundtruth.txt" not in self._logs:
                    self._append("groundtruth.txt", TUM_HEADER.rstrip("\n"))
                self._append("groundtruth.txt", tum_line(frame.stamp_ns, map_from_camera).rstrip("\n"))
            self._append("depth.txt", f"{text_from_stamp_ns(frame.stamp_ns)} {name}")
        except OSError as error:
            raise OutputError(f"cannot write {self._folder / name}: {error.strerror}") from error
        self._last_stamp_ns = frame.stamp_ns
        self._num_frames += 1

    def close(self) -> None:
        """Finish; nothing can be written afterwards."""
        self._is_closed = True
        while self._logs:
            self._logs.popitem()[1].close()

    def __enter__(self) -> ImageFolderWriter:
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _keep(self, num_frames: int) -> None:
        for name in ("depth.txt", "groundtruth.txt"):
            keep_lines(self._folder / name, num_frames + 1)
        for path in sorted((self._folder / "depth").glob("*.png")):
            if path.stem.isdecimal() and int(path.stem) >= num_frames:
                path.unlink(missing_ok=True)
        for name in ("depth.txt", "groundtruth.txt"):
            if (self._folder / name).is_file():
                self._logs[name] = LineLog(self._folder / name)
        self._num_frames = num_frames

    def _append(self, name: str, text: str) -> None:
        if name not in self._logs:
            self._logs[name] = LineLog(self._folder / name)
        self._logs[name].append(text)
