"""Transforms between coordinate frames over time, as robots publish them on ``/tf`` and ``/tf_static``.

Shared by the reader of bags and the ROS 2 node, with no ROS in it. A chain of transforms is looked up
at one stamp, each link of it interpolated by itself; nothing is extrapolated.
"""

from __future__ import annotations

from threading import RLock

import numpy as np

from stairmap.arrays import Transform, readonly
from stairmap.errors import TransformLookupError, TransformProblem
from stairmap.recordings.transform_history import MAX_TRANSFORM_GAP_NS, TransformHistory
from stairmap.transforms import invert_transform


class TransformBuffer:
    """A tree of coordinate frames, each with a transform to its parent that may change over time.

    Safe to use from several threads.

    Parameters
    ----------
    max_age_ns
        Transforms older than this against the newest of the same two coordinate frames are forgotten;
        ``None`` keeps all.
    max_gap_ns
        Transforms farther apart in time are not interpolated, except that a coordinate frame which has
        hardly moved may be silent for two and a half seconds.
    """

    def __init__(self, *, max_age_ns: int | None = None, max_gap_ns: int = MAX_TRANSFORM_GAP_NS) -> None:
        self._max_age_ns = max_age_ns
        self._max_gap_ns = max_gap_ns
        self._static: dict[str, tuple[str, Transform]] = {}
        self._moving: dict[str, dict[str, TransformHistory]] = {}
        self._frames: dict[str, None] = {}
        self._notes: dict[str, None] = {}
        self._lock = RLock()

    @property
    def notes(self) -> tuple[str, ...]:
        """One sentence for each coordinate frame that was given more than one parent."""
        return tuple(self._notes)

    def coordinate_frames(self) -> tuple[str, ...]:
        """Return the names of all coordinate frames, in the order in which they were first named."""
        return tuple(self._frames)

    def parents(self, child: str) -> tuple[str, ...]:
        """Return the parents of a coordinate frame: none of a root or unknown one, rarely more than one."""
        child = plain_name(child)
        with self._lock:
            static = [self._static[child][0]] if child in self._static else []
            return tuple(dict.fromkeys([*static, *self._moving.get(child, {})]))

    def add(self, parent: str, child: str, stamp_ns: int, parent_from_child: Transform) -> None:
        """Take a (4, 4) transform at a stamp; one of the same stamp replaces the one before.

        A coordinate frame that changes its parent has, at each time, the parent given nearest to it.
        """
        parent, child = plain_name(parent), plain_name(child)
        with self._lock:
            self._name_frames(parent, child)
            if self._static.get(child, ("",))[0] == parent:
                del self._static[child]
            histories = self._moving.setdefault(child, {})
            history = histories.setdefault(parent, TransformHistory())
            newest_ns = history.last_ns if len(history) else stamp_ns
            if self._max_age_ns is not None and stamp_ns < newest_ns - self._max_age_ns:
                return
            history.add(stamp_ns, parent_from_child)
            if self._max_age_ns is not None:
                history.drop_before(history.last_ns - self._max_age_ns)
            if len(self.parents(child)) > 1:
                self._note_parents(child)

    def add_static(self, parent: str, child: str, parent_from_child: Transform) -> None:
        """Take a (4, 4) transform that holds at all times; it replaces what was known of the child."""
        parent, child = plain_name(parent), plain_name(child)
        with self._lock:
            self._name_frames(parent, child)
            if any(name != parent for name in self.parents(child)):
                self._note_parents(child, parent)
            self._moving.pop(child, None)
            self._static[child] = (parent, readonly(parent_from_child))

    def clear(self) -> None:
        """Forget all transforms but the static ones, which nobody repeats after a jump in time."""
        with self._lock:
            self._moving.clear()

    def lookup(self, destination: str, source: str, stamp_ns: int) -> Transform:
        """Return the (4, 4) ``destination_from_source`` at a stamp.

        Raises
        ------
        TransformLookupError
            If a coordinate frame is unknown, no chain joins the two, or one link of it has no transform at
            this time; its ``problem`` tells which.
        """
        destination, source = plain_name(destination), plain_name(source)
        with self._lock:
            upward, downward = self._chains(destination, source, stamp_ns)
            ancestor_from_source = self._compose(upward, stamp_ns)
            ancestor_from_destination = self._compose(downward, stamp_ns)
        return np.asarray(invert_transform(ancestor_from_destination) @ ancestor_from_source)

    def latest_ns(self, destination: str, source: str) -> int:
        """Return the newest stamp, nanoseconds, up to which the whole chain between two frames has come.

        Raises
        ------
        TransformLookupError
            If a coordinate frame is unknown, or no chain joins the two.
        """
        destination, source = plain_name(destination), plain_name(source)
        with self._lock:
            now_ns = max(
                (history.last_ns for parents in self._moving.values() for history in parents.values()),
                default=0,
            )
            upward, downward = self._chains(destination, source, now_ns)
            moving = [
                self._moving[child][parent].last_ns
                for child in (*upward, *downward)
                if (parent := self._parent_at(child, now_ns)) in self._moving.get(child, {})
            ]
        return min(moving, default=now_ns)

    def _chains(self, destination: str, source: str, stamp_ns: int) -> tuple[list[str], list[str]]:
        """The frames from the source, and from the destination, up to below their common ancestor."""
        for name in (destination, source):
            self._check_known(name)
        ancestors = self._ancestors(destination, stamp_ns)
        places = {name: index for index, name in enumerate(ancestors)}
        upward: list[str] = []
        for name in self._ancestors(source, stamp_ns):
            if name in places:
                return upward, ancestors[: places[name]]
            upward.append(name)
        raise TransformLookupError(
            f"the coordinate frames {destination} and {source} are not connected: {source} hangs on "
            f"{upward[-1]}, {destination} on {ancestors[-1]}",
            TransformProblem.NOT_CONNECTED,
        )

    def _name_frames(self, *names: str) -> None:
        for name in names:
            self._frames.setdefault(name)

    def _note_parents(self, child: str, *others: str) -> None:
        names = " and ".join(sorted({*self.parents(child), *others}))
        self._notes.setdefault(
            f"the coordinate frame {child} has more than one parent, {names}; one publisher of it is too many"
        )

    def _check_known(self, name: str) -> None:
        if name not in self._frames:
            there_are = ", ".join(sorted(self._frames)) or "none yet"
            raise TransformLookupError(
                f"no coordinate frame '{name}'; there are: {there_are}", TransformProblem.UNKNOWN_FRAME
            )

    def _parent_at(self, child: str, stamp_ns: int) -> str | None:
        histories = {
            parent: history for parent, history in self._moving.get(child, {}).items() if len(history)
        }
        if child in self._static and not histories:
            return self._static[child][0]
        # The parent given last wins a tie, which is the one that two histories both cover.
        return min(reversed(histories), key=lambda name: histories[name].distance_ns(stamp_ns), default=None)

    def _ancestors(self, name: str, stamp_ns: int) -> list[str]:
        """The coordinate frame itself, its parent and so on up to the root, or until a loop closes."""
        chain = [name]
        while (parent := self._parent_at(chain[-1], stamp_ns)) is not None and parent not in chain:
            chain.append(parent)
        return chain

    def _compose(self, chain: list[str], stamp_ns: int) -> Transform:
        """(4, 4) transform of a chain's first coordinate frame into the parent of its last."""
        composed = np.eye(4)
        for child in chain:
            composed = self._link(child, stamp_ns) @ composed
        return composed

    def _link(self, child: str, stamp_ns: int) -> Transform:
        parent = self._parent_at(child, stamp_ns)
        assert parent is not None, "a chain ends below the root"
        if parent not in self._moving.get(child, {}):
            return self._static[child][1]
        history = self._moving[child][parent]
        found = history.at(stamp_ns, max_gap_ns=self._max_gap_ns)
        if not isinstance(found, TransformProblem):
            return found
        where = {
            TransformProblem.TOO_EARLY: f"the earliest is {history.first_ns * 1e-9:.3f} s",
            TransformProblem.NOT_YET: f"the latest is {history.last_ns * 1e-9:.3f} s",
        }.get(found)
        if where is None:
            before_ns, after_ns = history.stamps_around(stamp_ns)
            where = f"there is a gap of {(after_ns - before_ns) * 1e-9:.3f} s around it"
        raise TransformLookupError(
            f"no transform from {child} to {parent} at {stamp_ns * 1e-9:.3f} s: {where}", found
        )


def plain_name(name: str) -> str:
    """Return a coordinate frame's name without leading slashes, which tf2 no longer has."""
    return name.lstrip("/")
