"""Find the stairways of a recording with poses.

python examples/02_recording.py my_recording
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import stairmap


def main(folder: Path) -> None:
    """Print each stairway with the uncertainty of its measures."""
    recording = stairmap.open_recording(folder)  # up="-y" if y points down in the map
    session = stairmap.MapSession(stairmap.load_config(overrides=["detection.max_depth=5"]))

    for frame, map_from_camera in stairmap.placed_frames(recording):
        session.add(frame, map_from_camera)

    stairways = session.stairways()
    for stairway in stairways:
        print(f"stairway {stairway.id}, {stairway.num_observations} observations")
        for flight in stairway.flights:
            print(
                f"  {flight.num_risers} risers of {flight.rise * 1e3:.0f} ± {flight.std.rise * 1e3:.1f} mm, "
                f"run {flight.run * 1e3:.0f} ± {flight.std.run * 1e3:.1f} mm, "
                f"pitch {np.degrees(flight.pitch):.1f} deg"
            )
            print(f"  begins at {np.round(flight.base, 2).tolist()} m in the map")
    if not stairways:
        print("no stairway; stairmap run says why")
    for line in recording.problems.to_lines():
        print(line)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(f"usage:\n{__doc__}")
    main(Path(sys.argv[1]))
