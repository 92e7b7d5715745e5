"""depth.txt: which image was taken when. Files outside the recording are refused."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from stairmap.camera import PinholeCamera
from stairmap.errors import RecordingError
from stairmap.input_files import quoted
from stairmap.recordings.depth_png import HEADER_SIZE, DamagedImageError, check_png_header
from stairmap.recordings.stamped_table import StampedRow, load_stamped_table


@dataclass(frozen=True, slots=True, kw_only=True)
class ListedImage:
    """A line of depth.txt.

    Attributes
    ----------
    place
        ``file:line``, for messages.
    stamp_ns
        Stamp, in nanoseconds.
    name
        File name as listed, relative to the recording.
    path
        The file, links resolved.
    """

    place: str
    stamp_ns: int
    name: str
    path: Path


def load_depth_list(path: Path) -> tuple[ListedImage, ...]:
    """Read depth.txt and check that all its images are there.

    Raises
    ------
    RecordingError
        If the list cannot be read, is malformed or empty, or an image is not there or not in the folder.
    """
    # The links of the folder itself are the user's; those inside may come from a stranger's archive.
    folder = Path(os.path.realpath(path.parent))
    images = tuple(_image_from_row(row, folder) for row in load_stamped_table(path, "stamp_s filename"))
    if not images:
        raise RecordingError(f"expected lines 'stamp_s filename' in {path}, but it lists no image")
    missing = [image for image in images if not _is_file(image)]
    if missing:
        more = f" (nor are {len(missing) - 1} more)" if len(missing) > 1 else ""
        raise RecordingError(
            f"{missing[0].place}: {quoted(missing[0].name)} is not there{more}; restore it or delete the line"
        )
    return images


def check_image_headers(images: Iterable[ListedImage], camera: PinholeCamera) -> None:
    """Check that all images are 16-bit single-channel PNG of the camera's size.

    Images that are damaged pass: what is wrong with a single one shows when it is read.

    Raises
    ------
    RecordingError
        If one is of another kind or size, or cannot be read.
    """
    for image in images:
        try:
            with image.path.open("rb") as file:
                width, height = check_png_header(file.read(HEADER_SIZE))
        except DamagedImageError:
            continue
        except RecordingError as error:
            raise RecordingError(f"{image.place}: {image.name}: {error}") from error
        except OSError as error:
            raise RecordingError(f"{image.place}: cannot read {image.name}: {error.strerror}") from error
        if (width, height) != (camera.width, camera.height):
            raise RecordingError(
                f"{image.place}: {image.name} is {width}x{height}, but the camera file says "
                f"{camera.width}x{camera.height}; give the intrinsics of this resolution"
            )


def _image_from_row(row: StampedRow, folder: Path) -> ListedImage:
    name = row.cells[0]
    path = Path(os.path.realpath(folder / name))
    if not path.is_relative_to(folder):
        raise RecordingError(
            f"{row.place}: {quoted(name)} lies outside the recording; copy the images into its folder"
        )
    return ListedImage(place=row.place, stamp_ns=row.stamp_ns, name=name, path=path)


def _is_file(image: ListedImage) -> bool:
    try:
        return image.path.is_file()
    except OSError as error:
        raise RecordingError(f"{image.place}: cannot read {quoted(image.name)}: {error.strerror}") from error
