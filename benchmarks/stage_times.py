"""Which part of the default detector takes how long."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FunctionType
from typing import Any

from stairmap.detection import detector as detector_module


@contextmanager
def timed_stages() -> Iterator[dict[str, float]]:
    """Time every function of the detection package that the detector itself calls, while the context lasts.

    Yields
    ------
    Seconds by function name; calls inside of timed calls are part of the outer one.
    """
    seconds: dict[str, float] = {}
    depth = 0

    def timed(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **keywords: Any) -> Any:
            nonlocal depth
            if depth:
                return function(*arguments, **keywords)
            depth += 1
            start = time.thread_time()
            try:
                return function(*arguments, **keywords)
            finally:
                seconds[name] = seconds.get(name, 0.0) + time.thread_time() - start
                depth -= 1

        return call

    originals = {
        name: function
        for name, function in vars(detector_module).items()
        if isinstance(function, FunctionType)
        and function.__module__.startswith("stairmap.")
        and function.__module__ != detector_module.__name__
    }
    for name, function in originals.items():
        setattr(detector_module, name, timed(name, function))
    try:
        yield seconds
    finally:
        for name, function in originals.items():
            setattr(detector_module, name, function)
