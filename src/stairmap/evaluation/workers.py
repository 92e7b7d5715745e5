"""Set up a worker process before anything heavy is imported in it."""

from __future__ import annotations

import os


def prepare_worker() -> None:
    """Let a worker compute on one core: the pool already fills them all, and times are to be those of one."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"
    import cv2  # noqa: PLC0415

    cv2.setNumThreads(1)
