"""How the node fares, in words: what came in, what came of it, and why nothing comes out. No ROS in here."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from stairmap.detection.observation import Detection
from stairmap.kernels import describe_kernels

CLOCK = "clock"
"""Kind of the trouble that time stands still: it may be why nothing comes."""


class Level(IntEnum):
    """Level of a status; values as in ``diagnostic_msgs/DiagnosticStatus``."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Status:
    """One line that says how it is.

    Attributes
    ----------
    level
        How bad it is.
    kind
        What it is about, in one word: the same for the same trouble.
    message
        The line itself.
    """

    level: Level
    kind: str
    message: str


class NodeStatus:
    """Takes note of what happens and sums it up.

    Parameters
    ----------
    topics
        Names of the topics that must not be silent, with what they carry.
    max_silence
        After so long without a message, s, a topic is silent.
    now
        Time on the monotonic clock, s, as for all methods.
    wanted
        What must come.
    """

    def __init__(
        self,
        topics: dict[str, str],
        *,
        max_silence: float,
        now: float,
        wanted: str = "depth image with its camera_info",
    ) -> None:
        self._topics, self._wanted = topics, wanted
        self._max_silence = max_silence
        self._last_came: dict[str, float] = {}
        self._last_pair = now
        self._last_processed = now
        self._refusal: str | None = None
        self._refused_at = now
        self._last_detection: Detection | None = None
        self._delays: deque[float] = deque(maxlen=100)
        self._problems: dict[str, str] = {}
        self._notes: dict[str, str] = {}
        self.num_received = 0
        self.num_processed = 0
        self.num_detections = 0
        self.num_refused = 0
        self.num_jumps = 0
        self.num_invalid_transforms = 0

    def start(self, now: float) -> None:
        """Begin anew to wait for images, as after a time in which none was looked at."""
        self._last_pair = self._last_processed = now
        self._refusal = None

    def message_came(self, topic: str, now: float) -> None:
        """Note a message on one of the topics."""
        self._last_came[topic] = now

    def pair_came(self, now: float) -> None:
        """Note an image whose camera_info is known."""
        self.num_received += 1
        self._last_pair = now

    def refuse(self, reason: str, now: float) -> None:
        """Note an image that could not be used, and why."""
        self.num_refused += 1
        self._refusal, self._refused_at = reason, now

    def processed(self, detection: Detection, now: float) -> None:
        """Note an image that was looked at."""
        self.num_processed += 1
        self.num_detections += bool(detection)
        self._last_detection = detection
        self._last_processed = now
        self._refusal = None

    def published(self, delay: float) -> None:
        """Note how long after an image's stamp its result went out, s."""
        self._delays.append(delay)

    def set_problem(self, kind: str, problem: str | None) -> None:
        """Name a lasting trouble of another kind, such as a full disk; ``None`` when it is over."""
        if problem is None:
            self._problems.pop(kind, None)
        else:
            self._problems[kind] = problem

    def note(self, kind: str, text: str) -> None:
        """Note what looks strange but can be used; a later note of the same kind takes its place."""
        self._notes[kind] = text

    def status(self, num_stairways: int, unplaced: str | None, now: float) -> Status:
        """Say how it is.

        Parameters
        ----------
        num_stairways
            How many are confirmed.
        unplaced
            Why the last image has no pose; ``None`` if it has one.
        now
            Time, s.
        """
        silence = now - self._last_pair
        if silence > self._max_silence:
            return Status(level=Level.WARN, kind="silent", message=self._describe_silence(silence, now))
        if unplaced is not None and now - self._last_processed > 1.0:
            return Status(level=Level.WARN, kind="transform", message=f"no pose of the camera: {unplaced}")
        if self._refusal is not None and now - self._last_processed > 1.0:
            return Status(level=Level.ERROR, kind="input", message=self._refusal)
        if self._problems:
            kind, problem = next(iter(self._problems.items()))
            return Status(level=Level.ERROR, kind=kind, message=problem)
        if self.num_processed == 0:
            return Status(level=Level.OK, kind="waiting", message="waiting for the first image")
        kind = "found" if num_stairways else "looking"
        return Status(level=Level.OK, kind=kind, message=self._describe_result(num_stairways))

    def values(self, num_superseded: int, num_unplaced: int) -> dict[str, str]:
        """Return the numbers behind the status."""
        delays = np.array(self._delays) * 1e3
        delay = f"{np.median(delays):.0f} median, {delays.max():.0f} longest" if len(delays) else "none yet"
        return {
            "images received": str(self.num_received),
            "images processed": str(self.num_processed),
            "images with stair edges": str(self.num_detections),
            "images superseded by newer ones": str(num_superseded),
            "images dropped without a transform": str(num_unplaced),
            "images refused": str(self.num_refused),
            "jumps back in time": str(self.num_jumps),
            "invalid transforms": str(self.num_invalid_transforms),
            "delay of the last 100 results, ms": delay,
            "reason against the last image": self._last_rejection() or "none",
            "kernels": describe_kernels(),
            "notes": "; ".join(self._notes.values()) or "none",
        }

    def _describe_silence(self, silence: float, now: float) -> str:
        silent = []
        for topic, content in self._topics.items():
            came = self._last_came.get(topic)
            if came is None:
                silent.append(f"no {content} ever came on {topic}")
            elif now - came > self._max_silence:
                silent.append(f"no {content} on {topic} for {now - came:.1f} s")
        what = "; ".join(silent) or self._refusal or "depth and camera_info do not go together"
        if CLOCK in self._problems:
            what += f"; {self._problems[CLOCK]}"
        return f"no {self._wanted} for {silence:.1f} s: {what}"

    def _describe_result(self, num_stairways: int) -> str:
        if num_stairways:
            return f"{num_stairways} stairway{'s' if num_stairways > 1 else ''}"
        rejection = self._last_rejection()
        if self.num_detections:
            return f"no stairway yet: stair edges in {self.num_detections} images, not confirmed so far"
        return f"no stairway: the last image {f'fails {rejection}' if rejection else 'shows none'}"

    def _last_rejection(self) -> str | None:
        detection = self._last_detection
        if detection is None or detection or not detection.rejections:
            return None
        return str(detection.rejections[0])
