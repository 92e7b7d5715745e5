"""The rerun viewer as a process of its own."""

from __future__ import annotations

import socket
import urllib.request

import pytest

from stairmap.visualization.rerun_process import LOCAL, RerunProcess, ViewerError
from stairmap.visualization.rerun_viewer import RerunViewer
from stairmap.visualization.run_replay import load_run
from stairmap.visualization.stairway_labels import find_viewpoint


def free_port():
    with socket.socket() as probe:
        probe.bind((LOCAL, 0))
        return probe.getsockname()[1]


def test_web_viewer_is_served_to_this_machine_alone_and_ends(run_folder):
    pytest.importorskip("rerun")
    process = RerunProcess(web_port=free_port())
    try:
        with urllib.request.urlopen(process.url, timeout=10) as answer:
            assert b"<html" in answer.read().lower()
        with socket.socket() as other:
            # Another address of this machine, as a neighbour in the network would use it.
            other.settimeout(1)
            assert other.connect_ex(("127.0.0.2", process.web_port)) != 0
        assert process.is_running
    finally:
        process.stop()
    assert not process.is_running
    with socket.socket() as probe:
        assert probe.connect_ex((LOCAL, process.web_port)) != 0


def test_viewer_that_is_closed_early_does_not_disturb_the_run(run_folder):
    pytest.importorskip("rerun")
    replay = load_run(run_folder)
    viewpoint = find_viewpoint(replay.stairways, replay.positions)
    viewer = RerunViewer("run", viewpoint=viewpoint, positions=replay.positions, is_map=True)
    process = RerunProcess(web_port=free_port())
    try:
        viewer.connect(process.port)
        frames = replay.frames()
        viewer.show_frame(next(frames))
    finally:
        process.stop()
    for view in frames:
        viewer.show_frame(view)
    viewer.show_stairways(replay.stairways, 8, 0)
    viewer.close()


def test_port_that_is_taken_is_named():
    with socket.socket() as taken:
        taken.bind((LOCAL, 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ViewerError, match=rf"port {port} is taken; choose another with --port"):
            RerunProcess(web_port=port)


def test_window_without_a_display_points_to_what_works(monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(ViewerError, match=r"no display.*--save FILE\.rrd"):
        RerunProcess()
