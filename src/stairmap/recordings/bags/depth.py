"""The depth topic of a bag and the camera it was taken with, judged by its first images."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import DepthImage, Float32Array, Vector
from stairmap.camera import PinholeCamera
from stairmap.errors import CalibrationError, RecordingError
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.bags.bag import Bag
from stairmap.recordings.bags.message_decoding import header_of
from stairmap.recordings.bags.realsense_recorder import find_values_per_metre
from stairmap.recordings.bags.topics import (
    CAMERA_INFO,
    COMPRESSED_IMAGE,
    IMAGE,
    find_topic,
    guess_camera_info_topic,
    guess_depth_topic,
    topics_of_type,
)
from stairmap.recordings.camera_file import load_camera_file
from stairmap.recordings.camera_info import camera_from_info, find_camera_info_oddities
from stairmap.recordings.depth_message import depth_from_message
from stairmap.recordings.depth_png import DamagedImageError
from stairmap.recordings.depth_scale import MAX_MEDIAN_DEPTH, MIN_MEDIAN_DEPTH, NUM_FRAMES_CHECKED

MAX_MESSAGES_PEEKED = 300
"""How many images at most are read to learn what the image topics hold."""

MAX_IMAGES_SEARCHED = 50
"""How many depth images at most are read at opening to find some with depth."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BagDepth:
    """Where depth is in a bag.

    Attributes
    ----------
    topic
        Topic of the images.
    camera_info
        Topic, or file, of the intrinsics.
    camera
        The camera.
    frame_id
        Coordinate frame of the images.
    values_per_metre
        Scale of 16-bit images.
    up
        (3,) unit vector opposite to gravity in the camera frame, where a camera file says so.
    notes
        What looks strange but can be used, one sentence each.
    """

    topic: str
    camera_info: str
    camera: PinholeCamera
    frame_id: str
    values_per_metre: float
    up: Vector | None
    notes: tuple[str, ...]


def find_bag_depth(bag: Bag, options: BagOptions) -> BagDepth:
    """Find depth images and intrinsics that belong together.

    Raises
    ------
    RecordingError
        If there are none, or it cannot be told which; the message lists what there is.
    CalibrationError
        If the intrinsics are unusable or of another size, or depth is implausible.
    """
    if options.depth_topic is not None:
        topic = find_topic(
            bag.topics, options.depth_topic, IMAGE, COMPRESSED_IMAGE, option="--depth-topic"
        ).name
    else:
        topic = guess_depth_topic(bag.topics, peek_encodings(bag)).name
    camera_file = None if options.camera_file is None else load_camera_file(options.camera_file)
    values_per_metre = find_values_per_metre(bag, topic)
    if camera_file is not None:
        values_per_metre = camera_file.depth_scale
    first, frame_id = _check_first_images(bag, topic, values_per_metre)
    size = (first.shape[1], first.shape[0])
    if camera_file is not None:
        camera, info_name, notes = camera_file.camera, str(options.camera_file), camera_file.notes
        notes = (*notes, *_find_other_scale(bag, topic, info_name, camera_file.depth_scale))
        if (camera.width, camera.height) != size:
            raise CalibrationError(
                f"{options.camera_file} is for images of {camera.width}x{camera.height}, but those on "
                f"{topic} are {size[0]}x{size[1]}; give the intrinsics of this resolution"
            )
    else:
        camera, info_name, notes = _load_camera_info(bag, topic, size, options.camera_info_topic)
    return BagDepth(
        topic=topic,
        camera_info=info_name,
        camera=camera,
        frame_id=frame_id,
        values_per_metre=values_per_metre,
        up=None if camera_file is None else camera_file.up,
        notes=notes,
    )


def peek_encodings(bag: Bag) -> dict[str, str]:
    """Return encoding or format of the first image of each image topic, as far as it can be decoded."""
    wanted = {topic.name for topic in topics_of_type(bag.topics, IMAGE, COMPRESSED_IMAGE)}
    encodings: dict[str, str] = {}
    for count, message in enumerate(bag.messages(wanted)):
        if count >= MAX_MESSAGES_PEEKED or len(encodings) == len(wanted):
            break
        name = message.topic.name
        if name in encodings:
            continue
        try:
            image = bag.decode(message)
        except RecordingError:
            continue
        encodings[name] = image.encoding if hasattr(image, "encoding") else image.format
    return encodings


def _check_first_images(bag: Bag, topic: str, values_per_metre: float) -> tuple[DepthImage, str]:
    """Return the first image that can be read, and its coordinate frame.

    Raises
    ------
    RecordingError
        If the images hold something else than depth, or none can be read.
    CalibrationError
        If depth is not in metres.
    """
    first: DepthImage | None = None
    frame_id, reason = "", "there is none"
    sample: list[Float32Array] = []
    for count, message in enumerate(bag.messages([topic])):
        if count >= MAX_IMAGES_SEARCHED or len(sample) >= NUM_FRAMES_CHECKED:
            break
        try:
            image = bag.decode(message)
            depth = depth_from_message(image, values_per_metre=values_per_metre)
        except DamagedImageError as error:
            reason = str(error)
            continue
        except RecordingError as error:
            raise RecordingError(f"topic {topic}: {error}") from error
        if first is None:
            first, frame_id = depth, header_of(message)[1]
        valid = depth[np.isfinite(depth)]
        sample += [valid] if valid.size else []
    if first is None:
        raise RecordingError(f"topic {topic}: no image can be read; the last reason: {reason}")
    if sample:
        _check_median(float(np.median(np.concatenate(sample))), topic)
    return first, frame_id.lstrip("/")


def _find_other_scale(bag: Bag, topic: str, camera_file: str, depth_scale: float) -> tuple[str, ...]:
    """Return a note if a camera file, perhaps that of an image folder, has another scale than the bag."""
    usual = find_values_per_metre(bag, topic)
    if depth_scale == usual or peek_encodings(bag).get(topic, "").startswith("32FC1"):
        return ()
    return (
        f"{camera_file} gives {topic} {depth_scale:g} values per metre (depth_scale), where its encoding "
        f"means {usual:g}; write {usual:g} if depths are {usual / depth_scale:.3g} times what they should be",
    )


def _check_median(median_depth: float, topic: str) -> None:
    if MIN_MEDIAN_DEPTH <= median_depth <= MAX_MEDIAN_DEPTH:
        return
    raise CalibrationError(
        f"topic {topic}: expected a median depth of {MIN_MEDIAN_DEPTH:g} to {MAX_MEDIAN_DEPTH:g} m, got "
        f"{median_depth:.4g} m; 16UC1 must be millimetres and 32FC1 metres; other units of 16UC1 can be told "
        "with --camera camera.json (depth_scale)"
    )


def _load_camera_info(
    bag: Bag, depth_topic: str, size: tuple[int, int], wanted: str | None
) -> tuple[PinholeCamera, str, tuple[str, ...]]:
    if wanted is not None:
        topic = find_topic(bag.topics, wanted, CAMERA_INFO, option="--camera-info-topic")
    else:
        topic = guess_camera_info_topic(bag.topics, depth_topic)
    for message in bag.messages([topic.name]):
        info = bag.decode(message)
        try:
            camera = camera_from_info(info, size)
        except CalibrationError as error:
            raise CalibrationError(f"topic {topic.name}: {error}") from error
        notes = tuple(f"{topic.name}: {note}" for note in find_camera_info_oddities(info))
        return camera, topic.name, notes
    raise CalibrationError(f"topic {topic.name}: no message of it can be read")
