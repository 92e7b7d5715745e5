"""Runs a launch file until both of its programs have said what they were given.

Call it as ``run_launch_file.py FILE KEY:=TEXT …``.
In the environment of ``make_environment.py``, where ``launch`` and ``launch_ros`` can be imported.
"""

from __future__ import annotations

import sys

from launch.actions import EmitEvent, IncludeLaunchDescription, RegisterEventHandler, TimerAction
from launch.event_handlers import OnProcessIO
from launch.events import Shutdown
from launch.events.process import ProcessIO
from launch.launch_description_sources import PythonLaunchDescriptionSource

from launch import LaunchDescription, LaunchService

WANTED = ("no depth image with its camera_info", "rviz2 was started")
MAX_SECONDS = 60.0


def main() -> int:
    """Return 0 once all that is wanted was heard."""
    file, *arguments = sys.argv[1:]
    heard: list[str] = []

    def take(event: ProcessIO) -> EmitEvent | None:
        text = event.text.decode()
        sys.stdout.write(text)
        heard.append(text)
        is_done = all(wanted in "".join(heard) for wanted in WANTED)
        return EmitEvent(event=Shutdown(reason="heard all")) if is_done else None

    included = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(file),
        launch_arguments=[tuple(argument.split(":=", 1)) for argument in arguments],
    )
    too_late = TimerAction(period=MAX_SECONDS, actions=[EmitEvent(event=Shutdown(reason="too late"))])
    handler = RegisterEventHandler(OnProcessIO(on_stdout=take, on_stderr=take))
    service = LaunchService()
    service.include_launch_description(LaunchDescription([handler, included, too_late]))
    service.run()
    return 0 if all(wanted in "".join(heard) for wanted in WANTED) else 1


if __name__ == "__main__":
    sys.exit(main())
