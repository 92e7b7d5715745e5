"""Which part of the default detector takes how long."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FunctionType
from typing import Any

from stairmap.detection import candidate as candidate_module
from stairmap.detection import detector as detector_module


@contextmanager
def timed_stages() -> Iterator[dict[str, float]]:
    """Time the functions that the detector and its candidates call in other modules, while the context lasts.

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

    modules = (detector_module, candidate_module)
    originals = [
        (module, name, function)
        for module in modules
        for name, function in vars(module).items()
        if isinstance(function, FunctionType)
        and function.__module__.startswith("stairmap.")
        and function.__module__ not in {module.__name__ for module in modules}
    ]
    for module, name, function in originals:
        setattr(module, name, timed(name, function))
    try:
        yield seconds
    finally:
        for module, name, function in originals:
            setattr(module, name, function)
