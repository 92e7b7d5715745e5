"""ROS 2 of one's own: the node and a robot as processes that hear each other and nobody else."""

from __future__ import annotations

import json
import os
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from stairmap.stairway import Flight

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / ".venv-ros"


class Drive:
    """The rendered drive in a file, and the flight that is to be found."""

    def __init__(self, file: Path, true_flight: Flight) -> None:
        self.file = file
        self.true_flight = true_flight


class RosEnvironment:
    """Starts processes that hear each other and nobody else; ``variables`` are their environment."""

    def __init__(self, folder: Path, drive: Drive | None = None) -> None:
        self._folder = folder
        self._drive = drive
        self._processes: list[subprocess.Popen[bytes]] = []
        profile = str(ROOT / "ros/stairmap_ros/config/fastdds_large_images.xml")
        self.variables = os.environ | {
            "ROS_DOMAIN_ID": str((os.getpid() * 13 + time.monotonic_ns() // 1000) % 100 + 1),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "FASTRTPS_DEFAULT_PROFILES_FILE": profile,
            "FASTDDS_DEFAULT_PROFILES_FILE": profile,
            "ROS_LOG_DIR": str(folder / "log"),
            "OPENBLAS_NUM_THREADS": "1",
        }
        self.variables.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None)
        self.variables.pop("PYTHONPATH", None)

    def start_node(
        self,
        *,
        without_package: str = "",
        name: str = "stairmap",
        remaps: Mapping[str, str] = MappingProxyType({}),
        **parameters: Any,
    ) -> subprocess.Popen[bytes]:
        """Start the installed node; its output goes to ``node_log(name)``.

        It cannot import ``without_package``, as if that were not installed.
        """
        # A robot that waits for answers on a busy machine is silent for longer than the default.
        parameters = {"max_silence": 60.0, **parameters}
        variables = dict(self.variables)
        if without_package:
            missing = self._folder / "missing"
            missing.mkdir()
            (missing / f"{without_package}.py").write_text("raise ModuleNotFoundError(__name__)\n")
            variables["PYTHONPATH"] = str(missing)
        arguments = [part for key, value in parameters.items() for part in ("-p", f"{key}:={value}")]
        for source, target in {"__node": name, **remaps}.items():
            arguments += ["-r", f"{source}:={target}"]
        return self.start(
            name, ENVIRONMENT / "bin/stairmap_node", "--ros-args", *arguments, variables=variables
        )

    def start(
        self, name: str, *command: str | Path, variables: Mapping[str, str] | None = None
    ) -> subprocess.Popen[bytes]:
        """Start a program; its output goes to ``log_of(name)``."""
        with self.log_of(name).open("ab") as log:
            process = subprocess.Popen(
                command,
                env=self.variables if variables is None else variables,
                stdout=log,
                stderr=subprocess.STDOUT,
            )
        self._processes.append(process)
        return process

    def log_of(self, name: str) -> Path:
        """What a node has printed."""
        return self._folder / f"{name}.log"

    @property
    def node_log(self) -> Path:
        """What the node named stairmap has printed."""
        return self.log_of("stairmap")

    def start_robot(self) -> subprocess.Popen[bytes]:
        """Let the robot drive, and do not wait for it."""
        (self._folder / "orders.json").write_text(json.dumps([{}]))
        names = [self._drive.file, self._folder / "orders.json", self._folder / "out.json"]
        process = subprocess.Popen(
            [ENVIRONMENT / "bin/python", Path(__file__).parent / "simulated_robot.py", *names],
            env=self.variables,
        )
        self._processes.append(process)
        return process

    def run_robot(self, orders: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
        """Let the robot carry out its orders; return the outcome of each."""
        (self._folder / "orders.json").write_text(json.dumps(orders))
        names = [self._drive.file, self._folder / "orders.json", self._folder / "out.json"]
        subprocess.run(
            [ENVIRONMENT / "bin/python", Path(__file__).parent / "simulated_robot.py", *names],
            env=self.variables,
            check=True,
            timeout=240,
        )
        outcomes: list[dict[str, Any]] = json.loads((self._folder / "out.json").read_text())
        return outcomes

    def stop(self) -> None:
        """End what still runs."""
        for process in self._processes:
            if process.poll() is None:
                process.terminate()
        for process in self._processes:
            if process.poll() is None:
                try:
                    process.wait(timeout=10)
                except subprocess.TimeoutExpired:
                    process.kill()


def wait_for(condition: Callable[[], bool], seconds: float) -> bool:
    """Wait until something holds; false if it did not in time."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True
