"""Detect stairs in frames that another process asks for, with the kernels that its environment chooses.

usage: detection_worker.py FRAMES.pkl; reads numbers of frames from stdin, writes the milliseconds of each.
"""

from __future__ import annotations

import pickle
import sys
import time
from pathlib import Path

import cv2

from stairmap.config import Config
from stairmap.detection.detector import StairEdgeDetector

NUM_WARM_UP = 3


def main() -> None:
    """Answer until stdin ends."""
    cv2.setNumThreads(1)
    frames = pickle.loads(Path(sys.argv[1]).read_bytes())
    detector = StairEdgeDetector(Config())
    for frame in frames[:NUM_WARM_UP]:
        detector.detect(frame)
    print("ready", flush=True)
    for line in sys.stdin:
        frame = frames[int(line)]
        start = time.thread_time()
        detector.detect(frame)
        print(1e3 * (time.thread_time() - start), flush=True)


if __name__ == "__main__":
    main()
