"""MCAP files for Foxglove, read back with another library."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from stairmap.errors import MissingPackageError, OutputError
from stairmap.transforms import rotation_from_quat
from stairmap.visualization.foxglove_file import FoxgloveFile
from stairmap.visualization.run_replay import load_run, show_run


def write_mcap(run, path):
    replay = load_run(run)
    file = FoxgloveFile(path, name="run", frame_id=replay.frame_id, positions=replay.positions)
    show_run(replay, [file])
    return replay


class Contents:
    """Messages by topic, as (log time, message) pairs, and what else is in the file."""

    def __init__(self, path):
        reader_module = pytest.importorskip("mcap.reader")
        decoder = pytest.importorskip("mcap_protobuf.decoder")
        with path.open("rb") as stream:
            reader = reader_module.make_reader(stream, decoder_factories=[decoder.DecoderFactory()])
            summary = reader.get_summary()
            self.schemas = {}
            for channel in summary.channels.values():
                schema = summary.schemas.get(channel.schema_id)
                self.schemas[channel.topic] = (channel.message_encoding, schema.name if schema else "")
            self.metadata = {record.name: record.metadata for record in reader.iter_metadata()}
            self.messages = {}
            protobuf = [topic for topic, (encoding, _) in self.schemas.items() if encoding == "protobuf"]
            for _, channel, message, decoded in reader.iter_decoded_messages(topics=protobuf):
                self.messages.setdefault(channel.topic, []).append((message.log_time, decoded))
            others = [topic for topic in self.schemas if topic not in protobuf]
            for _, channel, message in reader.iter_messages(topics=others) if others else ():
                values = json.loads(message.data)
                self.messages.setdefault(channel.topic, []).append((message.log_time, values))


@pytest.fixture(scope="module")
def written(run_folder, tmp_path_factory):
    pytest.importorskip("foxglove")
    path = tmp_path_factory.mktemp("mcap") / "run.mcap"
    replay = write_mcap(run_folder, path)
    return replay, Contents(path)


def test_every_topic_has_a_schema_that_foxglove_knows(written):
    _, contents = written
    expected = {
        "/tf": "FrameTransforms",
        "/log": "Log",
        "/stairways": "SceneUpdate",
        "/stair_edges": "SceneUpdate",
        "/trajectory": "SceneUpdate",
        "/camera/depth": "RawImage",
        "/camera/calibration": "CameraCalibration",
        "/camera/points": "PointCloud",
        "/map/cloud": "PointCloud",
    }
    for topic, schema in expected.items():
        assert contents.schemas[topic] == ("protobuf", f"foxglove.{schema}")
    assert contents.schemas["/measures/stairway_1"][0] == "json"


def test_transforms_are_the_poses_at_their_stamps(written):
    replay, contents = written
    messages = contents.messages["/tf"]
    assert [stamp for stamp, _ in messages] == replay.trajectory.stamps_ns.tolist()
    for (_, message), pose in zip(messages, replay.trajectory.map_from_camera, strict=True):
        (transform,) = message.transforms
        assert (transform.parent_frame_id, transform.child_frame_id) == ("map", "camera")
        place, turn = transform.translation, transform.rotation
        assert np.allclose([place.x, place.y, place.z], pose[:3, 3])
        assert np.allclose(rotation_from_quat([turn.x, turn.y, turn.z, turn.w]), pose[:3, :3], atol=1e-7)


def test_depth_image_and_calibration_are_those_of_the_recording(written):
    replay, contents = written
    for view, (_, image), (_, calibration) in zip(
        replay.frames(),
        contents.messages["/camera/depth"],
        contents.messages["/camera/calibration"],
        strict=True,
    ):
        assert (image.encoding, image.frame_id, image.step) == ("16UC1", "camera", 2 * image.width)
        depth = np.frombuffer(image.data, "<u2").reshape(image.height, image.width) / 1e3
        expected = np.nan_to_num(view.frame.depth)
        assert np.abs(depth - expected).max() < 1.1e-3
        assert calibration.K[0] == view.frame.camera.fx
        assert calibration.P[6] == view.frame.camera.cy


def test_scene_has_the_nosings_box_and_measures_of_the_stairway(written):
    replay, contents = written
    (stairway,) = replay.stairways
    flight = stairway.flights[0]
    stamp, update = contents.messages["/stairways"][-1]
    assert stamp == replay.detections[-1].stamp_ns
    assert len(update.deletions) == 1
    (entity,) = update.entities
    assert (entity.id, entity.frame_id) == ("stairway_1", "map")
    points = np.array([[point.x, point.y, point.z] for point in entity.lines[0].points])
    assert np.allclose(points.reshape(-1, 2, 3), stairway.edges())
    size = entity.cubes[0].size
    assert (size.x, size.y, size.z) == pytest.approx((flight.box.depth, flight.box.width, flight.box.height))
    assert f"rise {flight.rise * 1e3:.0f} ± " in entity.texts[0].text
    assert len(entity.triangles[0].indices) % 3 == 0


def test_measures_over_time_end_with_the_result(written):
    replay, contents = written
    _, last = contents.messages["/measures/stairway_1"][-1]
    flight = replay.stairways[0].flights[0]
    assert last["rise"] == pytest.approx(flight.rise)
    assert last["run_std"] == pytest.approx(flight.std.run)
    assert last["num_observations"] == replay.stairways[0].num_observations
    counts = [values["num_observations"] for _, values in contents.messages["/measures/stairway_1"]]
    assert counts == sorted(counts)


def test_cloud_of_the_map_is_there_from_the_first_stamp(written):
    replay, contents = written
    ((stamp, cloud),) = contents.messages["/map/cloud"]
    assert stamp == replay.detections[0].stamp_ns
    assert cloud.point_stride == 16
    points = np.frombuffer(cloud.data, "<f4").reshape(-1, 4)[:, :3]
    assert len(points) > 1000
    floor = np.abs(points[:, 2]) < 0.02
    assert floor.sum() > 100


def test_log_and_metadata_tell_what_the_frames_and_the_run_said(written):
    _, contents = written
    lines = [message.message for _, message in contents.messages["/log"]]
    assert all(line.startswith(f"frame {number}: ") for number, line in enumerate(lines))
    assert contents.metadata["stairmap"]["num_stairways"] == "1"
    assert "rise mm" in contents.metadata["stairmap"]["stairways"]


def test_run_without_a_stairway_gives_a_file_with_its_frames(empty_run_folder, tmp_path):
    pytest.importorskip("foxglove")
    write_mcap(empty_run_folder, tmp_path / "run.mcap")
    contents = Contents(tmp_path / "run.mcap")
    assert len(contents.messages["/tf"]) == 3
    assert "no stairs" in contents.messages["/log"][0][1].message
    assert list(contents.messages["/stairways"][-1][1].entities) == []


def test_file_that_cannot_be_written_is_an_error(run_folder, tmp_path):
    pytest.importorskip("foxglove")
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot write"):
        write_mcap(run_folder, tmp_path / "file" / "run.mcap")


def test_disk_that_is_full_is_one_error(run_folder):
    pytest.importorskip("foxglove")
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full")
    with pytest.raises(OutputError, match="cannot write /dev/full: No space left on device"):
        write_mcap(run_folder, Path("/dev/full"))


def test_missing_package_names_its_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(MissingPackageError, match=r"stairmap\[foxglove\]"):
        FoxgloveFile(tmp_path / "run.mcap", name="run", frame_id="map", positions=np.empty((0, 3)))
