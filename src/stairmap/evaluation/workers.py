"""Processes that compute on one core each, set up before anything heavy is imported in them."""

from __future__ import annotations

import os
import signal
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context


def make_worker_pool(num_workers: int) -> ProcessPoolExecutor:
    """Return a pool of processes that compute on one core each.

    They are fresh interpreters: a fork copies threads' locks, and cannot be told to use one thread.
    """
    return ProcessPoolExecutor(num_workers, mp_context=get_context("spawn"), initializer=prepare_worker)


def prepare_worker() -> None:
    """Let a worker compute on one core, and end without a word at Ctrl-C.

    The pool already fills the cores, and times are to be those of one. The terminal sends Ctrl-C to all
    processes; only the first one answers it.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"
    import cv2  # noqa: PLC0415

    cv2.setNumThreads(1)
