"""Which of a robot's many transforms are kept of a long bag: those on the way from the camera to the root."""

from __future__ import annotations

from stairmap.arrays import Transform
from stairmap.recordings.transform_buffer import TransformBuffer, plain_name

MAP_FRAMES = ("map", "odom")
"""What the coordinate frame of the map is called (REP 105), the better one first."""

WORLD_FRAMES = (*MAP_FRAMES, "world", "earth")
"""Coordinate frames that stand still by their names."""


class TransformIntake:
    """Fills a buffer with the transforms that lead upwards from one coordinate frame.

    A walking robot publishes fifty joints a hundred times a second; of those that do not carry the camera
    only the latest transform is kept, until one turns out to do so.

    Parameters
    ----------
    source
        The coordinate frame whose place is asked for.
    also
        Another one from which upwards everything is kept.
    """

    def __init__(self, source: str, *, also: str | None = None) -> None:
        self.source = plain_name(source)
        self.buffer = TransformBuffer()
        self.num_invalid = 0
        self._parents: dict[str, str] = {}
        self._static: dict[str, tuple[str, Transform]] = {}
        self._frames: set[str] = set()
        self._also = None if also is None else plain_name(also)
        self._carriers = {name for name in (self.source, self._also) if name is not None}
        self._latest: dict[str, tuple[str, int, Transform]] = {}

    @property
    def has_static(self) -> bool:
        """Whether there is any static transform."""
        return bool(self._static)

    @property
    def coordinate_frames(self) -> tuple[str, ...]:
        """Names of all coordinate frames, sorted."""
        return tuple(sorted(self._frames))

    def take(
        self, parent: str, child: str, stamp_ns: int, transform: Transform | None, *, is_static: bool
    ) -> None:
        """Take a (4, 4) ``parent_from_child``; ``None`` is counted as invalid."""
        parent, child = plain_name(parent), plain_name(child)
        if transform is None:
            self.num_invalid += 1
            return
        self._frames |= {parent, child}
        self._parents[child] = parent
        if is_static:
            self.buffer.add_static(parent, child, transform)
            self._static[child] = (parent, transform)
            self._latest.pop(child, None)
        elif child in self._carriers:
            self.buffer.add(parent, child, stamp_ns, transform)
            self._static.pop(child, None)
        else:
            self._static.pop(child, None)
            self._latest[child] = (parent, stamp_ns, transform)
        if child in self._carriers:
            self._carry(parent)

    def ancestors(self) -> tuple[str, ...]:
        """Return the source, its parent and so on up to the root."""
        return self._chain(is_static_only=False)

    def static_root(self) -> str:
        """Return the outermost coordinate frame that the source is fixed to; itself if to none."""
        return self._chain(is_static_only=True)[-1]

    def is_fixed(self, ancestor: str) -> bool:
        """Tell whether the source never moves against one of its ancestors."""
        return ancestor in self._chain(is_static_only=True)

    def with_static_only(self) -> TransformIntake:
        """Return an intake that knows the static transforms and nothing else, as after a jump in time."""
        other = TransformIntake(self.source, also=self._also)
        for child, (parent, transform) in self._static.items():
            other.take(parent, child, 0, transform, is_static=True)
        return other

    def _chain(self, *, is_static_only: bool) -> tuple[str, ...]:
        chain = [self.source]
        while (parent := self._parents.get(chain[-1])) is not None and parent not in chain:
            if is_static_only and chain[-1] not in self._static:
                break
            chain.append(parent)
        return tuple(chain)

    def _carry(self, name: str) -> None:
        """From now on keep all transforms of a coordinate frame, and of those above it."""
        while name not in self._carriers:
            self._carriers.add(name)
            if name in self._latest:
                parent, stamp_ns, transform = self._latest.pop(name)
                self.buffer.add(parent, name, stamp_ns, transform)
            if name not in self._parents:
                return
            name = self._parents[name]


def guess_map_frame(intake: TransformIntake) -> str | None:
    """Return the ancestor of the camera that is the map: ``map``, else ``odom``, else the root if it moves.

    ``None`` if the camera is fixed to all there is above it, and none of that is a world by its name.
    """
    ancestors = intake.ancestors()
    for name in MAP_FRAMES:
        # Names may carry a robot's prefix: robot1/odom.
        found = next((ancestor for ancestor in ancestors if ancestor.split("/")[-1] == name), None)
        if found is not None:
            return found
    root = ancestors[-1]
    if root.split("/")[-1] in WORLD_FRAMES:
        return root
    return None if intake.is_fixed(root) else root
