"""Look for a stairway in one depth image, without poses.

python examples/01_one_image.py my_recording/depth/000000.png my_recording/camera.json
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import cv2
import numpy as np

import stairmap


def main(image: Path, camera_file: Path) -> None:
    """Print the stair edges of one image, or why there are none."""
    camera = stairmap.load_camera(camera_file)
    values = json.loads(camera_file.read_text())

    # Depth is metres; zero, as in many PNG files, is nothing measured.
    depth = cv2.imread(str(image), cv2.IMREAD_UNCHANGED) / values["depth_scale"]

    # Without `up` (against gravity, camera frame) the floor in view tells it.
    detection = stairmap.detect(depth, camera, up=values.get("up"))

    for observation in detection.observations:
        print(
            f"{observation.view}, {observation.num_steps} steps: rise {observation.rise * 1e3:.0f} mm, "
            f"run {observation.run * 1e3:.0f} mm, width {observation.width * 1e3:.0f} mm"
        )
        for edge in observation.edges:
            left, right = np.round(edge.nosing, 2).tolist()
            print(f"  step {edge.step_index}: from {left} to {right} m in the camera frame")
    if not detection:
        print("no stairway:", *detection.rejections, sep="\n  ")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(f"usage:\n{__doc__}")
    main(Path(sys.argv[1]), Path(sys.argv[2]))
