"""What identifies a recording: enough to notice that another one lies in its place."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from stairmap.camera import PinholeCamera
from stairmap.errors import RecordingError
from stairmap.input_files import CheckedModel, Stamp
from stairmap.recordings.base import Recording
from stairmap.recordings.stamped_table import text_from_stamp_ns


class SavedCamera(CheckedModel):
    """Intrinsics, px."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float


class RecordingIdentity(CheckedModel):
    """What identifies a recording.

    Attributes
    ----------
    num_frames
        Number of frames that it declares.
    first_stamp_ns, last_stamp_ns
        Stamps of the first and the last of them, nanoseconds.
    camera
        Its camera.
    stamps_sha256
        Hash of the stamps of all frames, as 64-bit integers, little endian.
    """

    num_frames: Annotated[int, Field(ge=1)]
    first_stamp_ns: Stamp
    last_stamp_ns: Stamp
    camera: SavedCamera
    stamps_sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]

    def to_dict(self) -> dict[str, Any]:
        """Return JSON types."""
        return self.model_dump()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Difference:
    what: str
    expected: object
    found: object


def identify_recording(recording: Recording) -> RecordingIdentity:
    """Return what identifies a recording; nothing of it is read again."""
    stamps_ns = recording.stamps_ns
    return RecordingIdentity(
        num_frames=recording.num_frames,
        first_stamp_ns=int(stamps_ns[0]),
        last_stamp_ns=int(stamps_ns[-1]),
        camera=_saved_camera(recording.camera),
        stamps_sha256=hashlib.sha256(np.asarray(stamps_ns, dtype="<i8").tobytes()).hexdigest(),
    )


def check_same_recording(recording: Recording, identity: RecordingIdentity) -> None:
    """Refuse another recording than the one that was identified.

    Raises
    ------
    RecordingError
        If it is another one; the message says by what.
    """
    found = identify_recording(recording)
    if found == identity:
        return
    differences = [
        _Difference(what="frames", expected=identity.num_frames, found=found.num_frames),
        _Difference(
            what="first stamp",
            expected=_seconds(identity.first_stamp_ns),
            found=_seconds(found.first_stamp_ns),
        ),
        _Difference(
            what="last stamp", expected=_seconds(identity.last_stamp_ns), found=_seconds(found.last_stamp_ns)
        ),
        _Difference(what="camera", expected=_describe(identity.camera), found=_describe(found.camera)),
        _Difference(what="list of stamps", expected=identity.stamps_sha256, found=found.stamps_sha256),
    ]
    first = next(difference for difference in differences if difference.expected != difference.found)
    raise RecordingError(
        f"expected the recording of this run, but {recording.name} is another one: {first.what} "
        f"{first.found} instead of {first.expected}; pass --recording PATH"
    )


def _saved_camera(camera: PinholeCamera) -> SavedCamera:
    return SavedCamera(
        width=int(camera.width),
        height=int(camera.height),
        fx=round(float(camera.fx), 6),
        fy=round(float(camera.fy), 6),
        cx=round(float(camera.cx), 6),
        cy=round(float(camera.cy), 6),
    )


def _seconds(stamp_ns: int) -> str:
    return f"{text_from_stamp_ns(stamp_ns)} s"


def _describe(camera: SavedCamera) -> str:
    numbers = ", ".join(f"{name} {getattr(camera, name)!r}" for name in ("fx", "fy", "cx", "cy"))
    return f"{camera.width}x{camera.height}, {numbers}"
