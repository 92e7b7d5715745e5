"""The files of depth images that a recording lists: PNG images, or organised clouds of a depth camera."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Protocol

import numpy as np

from stairmap.arrays import DepthImage, Points
from stairmap.errors import CalibrationError, RecordingError
from stairmap.input_files import MAX_IMAGE_SIZE, read_limited, shown
from stairmap.recordings.camera_file import MAX_SIDE, CameraFile, load_camera_file
from stairmap.recordings.clouds.cloud import Cloud, is_measured
from stairmap.recordings.clouds.open import open_cloud
from stairmap.recordings.clouds.pinhole_fit import (
    MAX_RAY_ERROR,
    OPTICAL_FROM_AXES,
    CloudCamera,
    depth_of,
    find_ray_error,
    fit_pinhole_camera,
)
from stairmap.recordings.depth_list import ListedImage, check_image_headers
from stairmap.recordings.depth_png import decode_depth_png
from stairmap.recordings.depth_scale import MAX_MEDIAN_DEPTH, check_depth_scale

ORGANISED_SUFFIXES = (".pcd",)
"""Endings of clouds that keep the rows and columns of an image."""

MAX_IMAGES_SEARCHED = 50
"""How many images at most are read at opening to find some with depth."""


class DepthFiles(Protocol):
    """The depth images of a recording and the camera that took them."""

    @property
    def camera_file(self) -> CameraFile:
        """Intrinsics, scale of the files, and notes."""
        ...

    def load(self, image: ListedImage) -> DepthImage:
        """Read an image; (height, width) metres.

        Raises
        ------
        RecordingError
            If it is damaged or of another size.
        """
        ...


def open_depth_files(images: Sequence[ListedImage], camera_path: Path | None) -> DepthFiles:
    """Check the files that a recording lists, and read its camera.

    Parameters
    ----------
    images
        PNG images, or organised clouds; the first one tells.
    camera_path
        The file ``camera.json``. Clouds need none: their points tell the intrinsics.

    Raises
    ------
    RecordingError
        If files are of another kind than they should be, or there are both kinds.
    CalibrationError
        If the camera file is missing where it is needed, or unusable, or depth is implausible with its scale.
    """
    is_cloud = [is_organised_name(image.name) for image in images]
    if any(is_cloud) != all(is_cloud):
        other = images[is_cloud.index(not is_cloud[0])]
        raise RecordingError(
            f"{other.place}: expected all files as the first one, {images[0].name}, got {other.name}; "
            "list images or clouds, not both"
        )
    if is_cloud[0]:
        files: DepthFiles = CloudFiles(images, camera_path)
    elif camera_path is None:
        raise CalibrationError(f"expected a camera file for {images[0].name}")
    else:
        files = PngFiles(images, camera_path)
    try:
        check_depth_scale(_readable_depths(files, images), files.camera_file.depth_scale)
    except CalibrationError as error:
        raise CalibrationError(f"{camera_path or images[0].path}: {error}") from error
    return files


def is_organised_name(name: str) -> bool:
    """Tell whether a file is a cloud that may be an image, by its ending."""
    return Path(name).suffix.lower() in ORGANISED_SUFFIXES


class PngFiles:
    """16-bit PNG images; see ``open_depth_files``."""

    def __init__(self, images: Sequence[ListedImage], camera_path: Path) -> None:
        self.camera_file = load_camera_file(camera_path)
        check_image_headers(images, self.camera_file.camera)

    def load(self, image: ListedImage) -> DepthImage:
        """Decode an image."""
        data = read_limited(image.path, max_size=MAX_IMAGE_SIZE, error_type=RecordingError)
        depth = decode_depth_png(data, self.camera_file.depth_scale)
        camera = self.camera_file.camera
        if depth.shape != (camera.height, camera.width):
            raise RecordingError(f"the image is {depth.shape[1]}x{depth.shape[0]}, not the camera's size")
        return depth


class CloudFiles:
    """Organised clouds; see ``open_depth_files``.

    Without a camera file they are in metres, unless all is so far away that it must be millimetres.
    """

    def __init__(self, images: Sequence[ListedImage], camera_path: Path | None) -> None:
        given = load_camera_file(camera_path) if camera_path is not None and camera_path.exists() else None
        found, points = _find_camera(images, given)
        self._optical_from_cloud = found.optical_from_cloud
        if given is not None:
            self.camera_file = given
            return
        camera = found.camera
        depth = depth_of(points @ self._optical_from_cloud.T)
        is_millimetres = float(np.nanmedian(depth)) > MAX_MEDIAN_DEPTH
        notes = [
            f"intrinsics are those that the points tell: {camera.width}x{camera.height}, fx {camera.fx:.2f}, "
            f"fy {camera.fy:.2f}, cx {camera.cx:.2f}, cy {camera.cy:.2f}; axes: {found.axes}"
        ]
        if is_millimetres:
            notes.append("coordinates are taken for millimetres, by their size")
        scale = 1000.0 if is_millimetres else 1.0
        self.camera_file = CameraFile(camera=camera, depth_scale=scale, notes=tuple(notes))

    def load(self, image: ListedImage) -> DepthImage:
        """Read a cloud; its points must lie on the rays of their pixels."""
        camera = self.camera_file.camera
        optical = load_organised(image.path) @ self._optical_from_cloud.T
        if optical.shape[:2] != (camera.height, camera.width):
            raise RecordingError(
                f"the cloud is {optical.shape[1]}x{optical.shape[0]}, not the camera's size, "
                f"{camera.width}x{camera.height}"
            )
        depth = depth_of(optical) / np.float32(self.camera_file.depth_scale)
        if np.isfinite(depth).any() and (off := find_ray_error(optical, camera)) > MAX_RAY_ERROR:
            raise RecordingError(f"its points lie {off:.2g} px off the rays of the camera's pixels")
        return depth


def _find_camera(images: Sequence[ListedImage], given: CameraFile | None) -> tuple[CloudCamera, Points]:
    """The camera of the first cloud that tells, and its points; of a given camera, only the axes."""
    reason: RecordingError | None = None
    for image in images[:MAX_IMAGES_SEARCHED]:
        try:
            points = load_organised(image.path)
        except RecordingError as error:
            reason = reason or error
            continue
        if given is not None:
            axes = [
                name
                for name, turn in OPTICAL_FROM_AXES.items()
                if find_ray_error(points @ turn.T, given.camera) <= MAX_RAY_ERROR
            ]
            if axes:
                return CloudCamera(camera=given.camera, axes=axes[0]), points
            what = "the camera file's camera"
        elif (found := fit_pinhole_camera(points)) is not None:
            return found, points
        else:
            what = "one pinhole camera"
        reason = reason or RecordingError(
            f"{shown(image.path)}: expected points on the rays of {what}, one for each pixel in its own "
            "coordinate frame; for a sweep of a LiDAR or a map: stairmap scan FILE"
        )
    if reason is None:
        raise RecordingError("there is no cloud")
    raise reason


def load_organised(path: Path) -> Points:
    """Return the (height, width, 3) points of an organised cloud; NaN or zeros where nothing was measured.

    Raises
    ------
    RecordingError
        If the file cannot be read, is not organised, or is larger than any camera's image.
    """
    cloud: Cloud = open_cloud(path)
    if cloud.shape is None:
        raise RecordingError(
            f"{shown(path)}: expected a cloud that is organised as an image (HEIGHT above 1), but its points "
            "are a plain list; stairmap scan FILE finds stairs in them"
        )
    if max(cloud.shape) > MAX_SIDE:
        raise RecordingError(
            f"{shown(path)}: expected an image of at most {MAX_SIDE} pixels a side, got "
            f"{cloud.shape[1]}x{cloud.shape[0]}; stairmap scan FILE finds stairs in large clouds"
        )
    points = np.concatenate(list(cloud.chunks()))
    points[~is_measured(points)] = np.nan
    return points.reshape(*cloud.shape, 3)


def _readable_depths(files: DepthFiles, images: Sequence[ListedImage]) -> Iterator[DepthImage]:
    for image in islice(images, MAX_IMAGES_SEARCHED):
        with suppress(RecordingError):  # iteration meets it again, and reports it
            yield files.load(image)
