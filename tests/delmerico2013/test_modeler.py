from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analytic_stairs import AnalyticStairs, nosings, pose_looking, render_frame
from delmerico2013.observations import MS, STAIRS, K, observations_of, poses_before_stairs, trajectory_of
from stairmap.arrays import Points
from stairmap.config import Config, load_config
from stairmap.delmerico2013 import modeler as modeler_module
from stairmap.delmerico2013.detector import Delmerico2013Detector
from stairmap.delmerico2013.modeler import Delmerico2013Modeler
from stairmap.errors import TrajectoryError
from stairmap.geometry import wrapped_angle
from stairmap.stairway import Flight, Stairway
from stairmap.transforms import invert_transform, rotation_from_vector, transform_from_parts, transform_points


def modeled(
    truth: Points, num: int = 2 * K, **how: float
) -> tuple[Delmerico2013Modeler, tuple[Stairway, ...]]:
    poses = poses_before_stairs(num)
    modeler = Delmerico2013Modeler(Config())
    for observation in observations_of(truth, poses, **how):
        modeler.add(observation)
    return modeler, modeler.stairways(trajectory_of(poses))


def only_flight(stairways: tuple[Stairway, ...]) -> Flight:
    (stairway,) = stairways
    (flight,) = stairway.flights
    return flight


@settings(deadline=None, max_examples=20)
@given(
    st.floats(0.12, 0.22),
    st.floats(0.22, 0.35),
    st.integers(3, 9),
    st.floats(-np.pi, np.pi),
    st.floats(0.8, 1.6),
)
def test_any_flight_is_recovered_from_points_along_its_nosings(
    rise: float, run: float, num_risers: int, heading: float, width: float
) -> None:
    stairs = AnalyticStairs(rise=rise, run=run, width=width, num_risers=num_risers, heading=heading)
    _, stairways = modeled(nosings(stairs))
    flight = only_flight(stairways)
    assert flight.rise == pytest.approx(rise, abs=0.004)
    assert flight.run == pytest.approx(run, abs=0.004)
    assert flight.width == pytest.approx(width, abs=0.1)
    assert flight.num_risers == num_risers
    assert wrapped_angle(flight.heading - heading) == pytest.approx(0, abs=np.radians(3))
    np.testing.assert_allclose(flight.base, 0, atol=0.05)


def test_report_of_a_flight_is_honest_about_its_ends_and_counts_its_observations() -> None:
    _, stairways = modeled(nosings(STAIRS))
    flight = only_flight(stairways)
    assert not flight.left_bounded
    assert not flight.right_bounded
    assert [step.num_observations for step in flight.steps] == [2 * K] * STAIRS.num_risers
    found = transform_points(
        invert_transform(STAIRS.map_from_flight()), np.array([step.nosing for step in flight.steps])
    )
    expected = transform_points(invert_transform(STAIRS.map_from_flight()), nosings(STAIRS))
    np.testing.assert_allclose(found[..., [0, 2]], expected[..., [0, 2]], atol=0.02)
    # The removal of statistical outliers trims the ends.
    np.testing.assert_allclose(found[..., 1], expected[..., 1], atol=0.2)
    assert (found[:, 0, 1] > found[:, 1, 1]).all()
    (stairway,) = stairways
    assert (stairway.id, stairway.num_observations) == (1, 2 * K)
    assert (stairway.first_seen_ns, stairway.last_seen_ns) == (0, (2 * K - 1) * MS)


def test_deviations_shrink_to_millimetres_for_regular_steps_and_are_all_positive() -> None:
    std = only_flight(modeled(nosings(STAIRS))[1]).std
    assert 0 < std.rise < 0.003
    assert 0 < std.run < 0.003
    assert 0 < std.pitch < np.radians(1)
    assert 0 < std.heading < np.radians(5)
    assert 0 < std.width < 0.1
    assert (std.base > 0).all()


def test_two_edges_give_a_flight_with_finite_deviations() -> None:
    flight = only_flight(modeled(nosings(STAIRS)[:2])[1])
    assert flight.num_risers == 2
    assert 0 < flight.std.rise < 0.05
    json.dumps(flight.to_dict(), allow_nan=False)


def test_one_edge_gives_no_stairway_and_the_reason() -> None:
    # A wide spread makes of one edge a cloud with a plane, but no second cluster.
    modeler, stairways = modeled(nosings(STAIRS)[:1], spread=0.02)
    assert stairways == ()
    assert modeler.rejection is not None
    assert (modeler.rejection.rule, modeler.rejection.limit) == ("min_clusters", 2)
    assert modeler.rejection.measured < 2


def test_level_edges_give_no_stairway() -> None:
    level = nosings(STAIRS) * [1.0, 1.0, 0.0]
    modeler, stairways = modeled(level, spread=0.0)
    assert stairways == ()
    assert modeler.rejection is not None


def test_edge_of_too_few_points_between_others_doubles_a_difference_as_in_the_report() -> None:
    truth = nosings(STAIRS)
    flight = only_flight(modeled(truth[[0, 1, 3, 4, 5]])[1])
    assert flight.rise == pytest.approx(STAIRS.rise * 5 / 4, abs=0.005)
    assert flight.std.rise > 0.02


def test_scattered_points_move_the_model_by_less_than_a_centimetre() -> None:
    clean, dirty = (only_flight(modeled(nosings(STAIRS), outliers=num)[1]) for num in (0, 100))
    assert dirty.rise == pytest.approx(clean.rise, abs=0.01)
    assert dirty.run == pytest.approx(clean.run, abs=0.01)
    np.testing.assert_allclose(dirty.base[2], clean.base[2], atol=0.02)


def test_models_are_fitted_at_multiples_of_k_only() -> None:
    poses = poses_before_stairs(2 * K + 1)
    trajectory = trajectory_of(poses)
    modeler = Delmerico2013Modeler(Config())
    assert modeler.stairways(trajectory) == ()
    counts = []
    for observation in observations_of(nosings(STAIRS), poses):
        modeler.add(observation)
        stairways = modeler.stairways(trajectory)
        counts.append(stairways[0].num_observations if stairways else 0)
    assert counts == [0] * (K - 1) + [K] * K + [2 * K] * 2


def test_k_comes_from_the_config() -> None:
    poses = poses_before_stairs(3)
    modeler = Delmerico2013Modeler(load_config(None, ["delmerico2013.detections_per_fit=3"]))
    for observation in observations_of(nosings(STAIRS), poses):
        assert modeler.stairways(trajectory_of(poses)) == ()
        modeler.add(observation)
    assert modeler.stairways(trajectory_of(poses))


def test_clusters_up_to_the_configs_number_of_points_are_no_edges() -> None:
    poses = poses_before_stairs(K)
    strict = Delmerico2013Modeler(load_config(None, ["delmerico2013.min_cluster_points=100000"]))
    for observation in observations_of(nosings(STAIRS), poses):
        strict.add(observation)
    assert strict.stairways(trajectory_of(poses)) == ()
    assert strict.rejection is not None
    assert (strict.rejection.rule, strict.rejection.measured) == ("min_clusters", 0)


def test_answer_does_not_depend_on_how_often_one_asks() -> None:
    poses = poses_before_stairs(4 * K)
    observations = observations_of(nosings(STAIRS), poses, outliers=20)
    often, once = Delmerico2013Modeler(Config()), Delmerico2013Modeler(Config())
    for count, observation in enumerate(observations, 1):
        often.add(observation)
        often.stairways(trajectory_of(poses[:count]))
        once.add(observation)
    results = [modeler.stairways(trajectory_of(poses))[0].to_dict() for modeler in (often, once)]
    assert results[0] == results[1]


def test_asking_again_without_k_new_observations_fits_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    fits = []
    fit_flight = modeler_module.fit_flight
    monkeypatch.setattr(
        modeler_module, "fit_flight", lambda *args, **kwargs: fits.append(1) or fit_flight(*args, **kwargs)
    )
    poses = poses_before_stairs(2 * K + 3)
    modeler, _ = modeled(nosings(STAIRS), num=2 * K)
    assert len(fits) == 2
    for observation in observations_of(nosings(STAIRS), poses)[2 * K :]:
        modeler.add(observation)
    # Poses after the observations used may change without a new fit.
    poses[-1] = np.eye(4)
    assert modeler.stairways(trajectory_of(poses))
    assert len(fits) == 2


@settings(deadline=None, max_examples=10)
@given(st.floats(-np.pi, np.pi), st.floats(-5, 5), st.floats(-5, 5), st.floats(-2, 2))
def test_moved_trajectory_moves_the_model(yaw: float, x: float, y: float, z: float) -> None:
    corrected_from_map = transform_from_parts(rotation_from_vector([0.0, 0.0, yaw]), [x, y, z])
    modeler, stairways = modeled(nosings(STAIRS))
    before = only_flight(stairways)
    poses = [corrected_from_map @ pose for pose in poses_before_stairs(2 * K)]
    after = only_flight(modeler.stairways(trajectory_of(poses)))
    np.testing.assert_allclose(after.base, transform_points(corrected_from_map, before.base), atol=0.03)
    assert wrapped_angle(after.heading - before.heading - yaw) == pytest.approx(0, abs=np.radians(2))
    assert after.rise == pytest.approx(before.rise, abs=0.003)
    assert after.run == pytest.approx(before.run, abs=0.003)
    assert after.num_risers == before.num_risers


def test_trajectory_moved_back_gives_the_first_model_again() -> None:
    modeler, stairways = modeled(nosings(STAIRS))
    shifted = [transform_from_parts(np.eye(3), [0.0, 3.0, 0.0]) @ pose for pose in poses_before_stairs(2 * K)]
    assert modeler.stairways(trajectory_of(shifted))[0].to_dict() != stairways[0].to_dict()
    again = modeler.stairways(trajectory_of(poses_before_stairs(2 * K)))
    assert again[0].to_dict() == stairways[0].to_dict()


def test_observation_without_a_pose_is_an_error() -> None:
    poses = poses_before_stairs(K)
    modeler = Delmerico2013Modeler(Config())
    for observation in observations_of(nosings(STAIRS), poses):
        modeler.add(observation)
    with pytest.raises(TrajectoryError, match="no pose within"):
        modeler.stairways(trajectory_of(poses[:-1]))


def test_stairs_driven_up_to_are_modeled_from_their_depth_images() -> None:
    stairs = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=8)
    detector, modeler = Delmerico2013Detector(Config()), Delmerico2013Modeler(Config())
    poses = [pose_looking((-2.5 + 0.06 * index, 0.1, 0.4), down=-0.1) for index in range(25)]
    for index, pose in enumerate(poses):
        frame = render_frame(stairs, pose, stamp_ns=index * MS, wall_at=4, noise_seed=index)
        for observation in detector.detect(frame).observations:
            modeler.add(observation)
    flight = only_flight(modeler.stairways(trajectory_of(poses)))
    assert flight.rise == pytest.approx(stairs.rise, abs=0.01)
    assert flight.run == pytest.approx(stairs.run, abs=0.015)
    assert 0.5 < flight.width < 1.4
    assert flight.heading == pytest.approx(0, abs=np.radians(5))
