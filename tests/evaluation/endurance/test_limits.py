"""Limits are checked on the true motion alone, with legs computed anew."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.platform.kinematics import leg_motion
from motion_cueing.envs.simulator.simulator import TIME_STEP, Simulator
from motion_cueing.evaluation.endurance.run import KINDS, TOLERANCE, TrueLimits

from ...envs.platform.platforms_under_test import PRESETS
from ...reference import MachineModel
from ...reference import kinematics as plain
from ..studies.bends import PAPER, bend

RNG = np.random.default_rng(4)
POSE, POSE_RATE = 0.1 * RNG.normal(size=(50, 6)), 0.3 * RNG.normal(size=(50, 6))
EPSILON = 1e-6
BEYOND = 1.0 + 2.0 * TOLERANCE


def lengths(hexapod, pose):
    tops = Rotation.from_euler("XYZ", pose[:, 3:]).as_matrix() @ np.array(hexapod.upper_joints).T
    legs = np.moveaxis(tops, 1, 2) - hexapod.lower_joints + hexapod.neutral + pose[:, None, :3]
    return np.linalg.norm(legs, axis=2)


@pytest.mark.parametrize("platform", PRESETS.values(), ids=list(PRESETS))
def test_legs_are_distances_and_their_rates_derivatives(platform):
    hexapod = platform.hexapod
    found = leg_motion(hexapod, POSE, POSE_RATE)
    np.testing.assert_allclose(found.extension, lengths(hexapod, POSE) - hexapod.neutral_lengths, atol=1e-13)
    ahead, behind = (lengths(hexapod, POSE + sign * EPSILON * POSE_RATE) for sign in (1.0, -1.0))
    np.testing.assert_allclose(found.rate, (ahead - behind) / (2.0 * EPSILON), atol=1e-8)
    np.testing.assert_allclose(found.clearance, plain.clearance(MachineModel.of(platform), POSE), atol=1e-12)


def motions(steps, platform=PAPER, n=2):
    """(steps, n) rows of a machine at rest."""
    simulator = Simulator(platform, [bend()] * n)
    return np.tile(simulator.reset()["motion"], (steps, 1))


def exceeded(motion, platform=PAPER):
    found = TrueLimits(platform, motion.shape[1], TIME_STEP).exceeded(motion)
    return {kind: np.argwhere(found[kind]).tolist() for kind in KINDS if found[kind].any()}


def test_a_machine_at_rest_keeps_all_limits():
    assert exceeded(motions(5)) == {}


@pytest.mark.parametrize(
    ("actuator", "end"), [(0, PAPER.carriage.travel_x[0]), (1, PAPER.carriage.travel_y[1])]
)
def test_a_carriage_beyond_its_travel_is_counted(actuator, end):
    motion = motions(4)
    motion["position"][:, 0, actuator] = end
    assert exceeded(motion) == {}
    # The tolerance is of the whole stroke, which is twice as far.
    motion["position"][2:, 0, actuator] = end * BEYOND * BEYOND
    assert exceeded(motion) == {"position": [[2, 0], [3, 0]]}


def test_a_leg_beyond_its_stroke_is_counted_by_the_pose_alone():
    motion, down = motions(3), np.linspace(0.0, 1.0, 100_001)
    poses = np.zeros((len(down), 6))
    poses[:, 2] = down
    legs = leg_motion(PAPER.hexapod, poses, np.zeros_like(poses)).extension
    first = int(np.argmax((legs < PAPER.hexapod.extension[0] - 1e-5).any(axis=1)))
    motion["displacement"][1, 1, 2] = down[first]
    motion["position"][1, 1, 2:8] = legs[first]
    assert exceeded(motion) == {"position": [[1, 1]]}
    # The machine's step says the legs are where they may be: then they do not hold the platform.
    motion["position"][1, 1, 2:8] = 0.0
    assert exceeded(motion) == {"position": [[1, 1]], "pose": [[1, 1]]}


def test_speeds_beyond_their_limits_are_counted():
    motion = motions(4)
    motion["rate"][..., 0] = PAPER.carriage.velocity * BEYOND
    motion["rate"][:, 0, 8] = -PAPER.turntable.velocity * BEYOND
    motion["rate"][:, 1, 0] = PAPER.carriage.velocity
    assert exceeded(motion) == {"rate": [[k, 0] for k in range(4)]}
    # The legs' rates in the machine's step are not believed, the platform's velocity is.
    motion = motions(4)
    motion["rate"][..., 2:8] = 10.0
    assert exceeded(motion) == {}
    motion["velocity"][:, 1, 2] = 2.0 * PAPER.hexapod.velocity
    assert exceeded(motion) == {"rate": [[k, 1] for k in range(4)]}


def test_accelerations_count_from_sample_to_sample_and_from_block_to_block():
    motion, limits = motions(4), TrueLimits(PAPER, 2, TIME_STEP)
    step = PAPER.turntable.acceleration * TIME_STEP
    motion["rate"][:, 0, 8] = step * np.arange(4)
    motion["rate"][:, 1, 8] = step * np.array([0.0, 0.0, -1.0 - 1e-5, -1.0])
    found = limits.exceeded(motion)["acceleration"]
    assert np.argwhere(found).tolist() == [[2, 1]]
    assert limits.use["acceleration"] == pytest.approx(1.0 + 1e-5)
    motion["rate"][:, 0, 8] = step * np.arange(5, 9)
    motion["rate"][:, 1, 8] = -step
    assert np.argwhere(limits.exceeded(motion)["acceleration"]).tolist() == [[0, 0]]


def test_motion_that_is_not_a_number_keeps_no_limit():
    motion = motions(3)
    motion["beta"][1, 1, 0] = np.nan
    found = exceeded(motion)
    assert set(found) == set(KINDS)
    assert found["number"] == [[1, 1]]
    assert found["acceleration"] == [[1, 1], [2, 1]]


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_extremes_are_those_of_what_is_finite(wrong):
    """Nothing else can be written down; a motion that is no number hides no other."""
    motion, limits = motions(3), TrueLimits(PAPER, 2, TIME_STEP)
    for field in ("position", "rate"):
        motion[field][1, 1, 0] = wrong
    motion["beta"][1, 1, 1] = wrong
    motion["position"][2, 0, 0] = 0.5 * PAPER.carriage.travel_x[1]
    assert limits.exceeded(motion)["number"].sum() == 1
    assert limits.use["position"] == pytest.approx(0.5)
    assert np.isfinite([*limits.use.values(), limits.clearance]).all()


def test_what_is_not_there_must_not_move():
    fixed = PAPER.without_carriage().without_turntable()
    motion = motions(3, fixed)
    assert exceeded(motion, fixed) == {}
    motion["position"][1, 0, 0] = 1e-3
    motion["position"][2, 1, 8] = 1e-3
    assert exceeded(motion, fixed) == {"position": [[1, 0], [2, 1]]}


def test_a_platform_turned_over_is_no_pose():
    motion = motions(1)
    pose = np.zeros((1, 6))
    pose[0, 3] = np.pi
    motion["beta"][0, 0, 0] = np.pi
    motion["position"][0, 0, 2:8] = leg_motion(PAPER.hexapod, pose, np.zeros((1, 6))).extension[0]
    assert leg_motion(PAPER.hexapod, pose, np.zeros((1, 6))).clearance[0] < 0.0
    assert exceeded(motion)["pose"] == [[0, 0]]


def test_an_unlimited_turntable_may_turn_on():
    motion = motions(2)
    assert get_platform("paper").turntable.travel is None
    motion["position"][..., 8] = 1e4
    assert exceeded(motion) == {}
