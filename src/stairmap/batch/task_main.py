"""The process in which a worker looks at recordings: it may be killed by one, the worker is not.

``python -m stairmap.batch.task_main DESCRIPTOR`` answers calls that come through a socket until that is
closed; then, or when its worker is killed, it ends at once, in the middle of a recording too: somebody else
does that one from the beginning, and two must not.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any


def main() -> None:
    """Answer calls (function, arguments) with (True, result) or (False, error)."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the terminal sends it to all; whoever asked answers it
    connection: Connection[Any, Any] = Connection(int(sys.argv[1]))
    calls: SimpleQueue[tuple[Any, tuple[Any, ...]]] = SimpleQueue()
    threading.Thread(target=_receive, args=(connection, calls), daemon=True).start()
    import cv2  # noqa: PLC0415

    cv2.setNumThreads(1)
    while True:
        function, arguments = calls.get()
        try:
            answer = True, function(*arguments)
        except Exception as error:
            answer = False, error
        connection.send(answer)


def _receive(connection: Connection[Any, Any], calls: SimpleQueue[tuple[Any, tuple[Any, ...]]]) -> None:
    try:
        while True:
            calls.put(connection.recv())
    except (EOFError, OSError):
        os._exit(0)


if __name__ == "__main__":
    main()
