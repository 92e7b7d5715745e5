"""Clocks that go back: a bag that plays in a loop, a simulation that starts again. No ROS in here."""

from __future__ import annotations

MIN_JUMP_NS = 1_000_000_000
"""A stamp this much older than the newest of its source is a jump and no late message, nanoseconds."""


class TimeJumps:
    """Watches the stamps of several sources."""

    def __init__(self) -> None:
        self._newest_ns: dict[str, int] = {}

    def find(self, source: str, stamp_ns: int) -> int:
        """Return how far the clock has gone back with this stamp, nanoseconds; 0 if it has not.

        After a jump all sources begin anew. A stamp of 0 is a stamp that was never set, and no jump.
        """
        if stamp_ns == 0:
            return 0
        newest_ns = self._newest_ns.get(source, stamp_ns)
        if stamp_ns < newest_ns - MIN_JUMP_NS:
            self._newest_ns = {source: stamp_ns}
            return newest_ns - stamp_ns
        self._newest_ns[source] = max(newest_ns, stamp_ns)
        return 0
