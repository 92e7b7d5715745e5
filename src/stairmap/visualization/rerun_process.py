"""The rerun viewer as a process of its own that listens on 127.0.0.1 and nowhere else.

rerun's own ways of starting a viewer listen on every network interface of the machine.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time

from stairmap.errors import StairmapError

LOCAL = "127.0.0.1"
DEFAULT_WEB_PORT = 9090

_START_LIMIT = 30.0
"""How long a viewer may take to listen, s."""

_STOP_LIMIT = 5.0
"""How long a viewer may take to end before it is killed, s."""


class ViewerError(StairmapError):
    """A viewer cannot be started."""


class RerunProcess:
    """Starts a rerun viewer and waits until it listens.

    Parameters
    ----------
    web_port
        Port at which a browser finds it; ``None`` opens a window instead.

    Attributes
    ----------
    port
        Where it takes in data.

    Raises
    ------
    ViewerError
        If the port is taken, there is no display for a window, or the viewer does not start.
    """

    def __init__(self, *, web_port: int | None = None) -> None:
        self.web_port = web_port
        self.port = _free_port()
        arguments = ["--bind", LOCAL, "--port", str(self.port)]
        if web_port is None:
            _check_display()
            arguments.append("--hide-welcome-screen")
        else:
            _check_port_is_free(web_port)
            arguments += ["--serve-web", "--web-viewer-port", str(web_port), "--server-memory-limit", "50%"]
        command = [sys.executable, "-m", "rerun_cli", *arguments]
        self._process = subprocess.Popen(
            command,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is for stairmap; a window stays open after it
        )
        self._ports = (self.port,) if web_port is None else (self.port, web_port)
        for port in self._ports:
            self._wait_for(port)

    @property
    def url(self) -> str:
        """What to open in a browser of this machine."""
        return f"http://{LOCAL}:{self.web_port}/?url=rerun%2Bhttp%3A%2F%2F{LOCAL}%3A{self.port}%2Fproxy"

    @property
    def is_running(self) -> bool:
        """Whether the viewer has not ended yet."""
        return self._process.poll() is None

    def stop(self) -> None:
        """End the viewer; when this returns, its ports are free."""
        if not self.is_running:
            return
        # ``rerun_cli`` is a Python program that starts the viewer proper: end the whole session.
        for number in (signal.SIGTERM, signal.SIGKILL):
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, number)
            deadline = time.monotonic() + _STOP_LIMIT
            while time.monotonic() < deadline:
                if not self.is_running and not any(_is_listening(port) for port in self._ports):
                    return
                time.sleep(0.05)

    def _wait_for(self, port: int) -> None:
        deadline = time.monotonic() + _START_LIMIT
        while not _is_listening(port):
            if self._process.poll() is not None:
                raise ViewerError(
                    f"the rerun viewer ended at once with code {self._process.returncode}; "
                    "try --web, or --save FILE.rrd"
                )
            if time.monotonic() > deadline:
                self.stop()
                raise ViewerError(
                    f"the rerun viewer did not listen within {_START_LIMIT:.0f} s; try --save FILE.rrd"
                )
            time.sleep(0.05)


def _check_display() -> None:
    if sys.platform.startswith("linux") and not any(
        os.environ.get(n) for n in ("DISPLAY", "WAYLAND_DISPLAY")
    ):
        raise ViewerError(
            "there is no display to open a window on; use --web, --save FILE.rrd or --page FILE.html"
        )


def _check_port_is_free(port: int) -> None:
    if _is_listening(port):
        raise ViewerError(f"port {port} is taken; choose another with --port")


def _is_listening(port: int) -> bool:
    with socket.socket() as probe:
        probe.settimeout(0.5)
        return probe.connect_ex((LOCAL, port)) == 0


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((LOCAL, 0))
        port: int = probe.getsockname()[1]
        return port
