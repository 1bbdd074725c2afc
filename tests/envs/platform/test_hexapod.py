"""Leg lengths, their derivatives, and back: Eqs. (12), (13)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motion_cueing.envs.errors import DataError, GeometryError
from motion_cueing.envs.platform import Platform, legs_of_pose, pose_of_legs
from motion_cueing.envs.platform.kinematics import leg_motion, rotation, turning_axes

from ...reference import MachineModel
from ...reference import kinematics as plain
from .platforms_under_test import PRESETS
from .probes import leg_rows

# Poses within every preset's reach: share of the stroke, and rad.
SPAN = np.array([0.5, 0.5, 0.5, 0.2, 0.2, 0.3])
RNG = np.random.default_rng(8)
DIRECTION = RNG.uniform(-1.0, 1.0, size=(100, 6))

every_preset = pytest.mark.parametrize("platform", PRESETS.values(), ids=list(PRESETS))
unit = st.floats(-1.0, 1.0)


def within(platform: Platform, share: np.ndarray) -> np.ndarray:
    stroke = min(platform.hexapod.extension[1], -platform.hexapod.extension[0])
    return np.asarray(share * SPAN * np.array([stroke, stroke, stroke, 1.0, 1.0, 1.0]))


def poses(platform: Platform) -> np.ndarray:
    return within(platform, np.random.default_rng(9).uniform(-1.0, 1.0, size=DIRECTION.shape))


@every_preset
def test_lengths_are_distances_between_joints(platform):
    legs = platform.hexapod
    for pose in poses(platform):
        top = Rotation.from_euler("XYZ", pose[3:]).apply(np.array(legs.upper_joints))
        distance = np.linalg.norm(top + legs.neutral + pose[:3] - np.array(legs.lower_joints), axis=1)
        np.testing.assert_allclose(legs_of_pose(legs, pose), distance - legs.neutral_lengths, atol=1e-14)


@settings(max_examples=200)
@given(name=st.sampled_from(list(PRESETS)), share=st.tuples(*[unit] * 6))
def test_forward_kinematics_undoes_inverse_kinematics(name, share):
    legs, pose = PRESETS[name].hexapod, within(PRESETS[name], np.array(share))
    np.testing.assert_allclose(pose_of_legs(legs, legs_of_pose(legs, pose)), pose, atol=1e-11)


@every_preset
def test_legs_in_motion_are_those_of_the_kernels(platform):
    pose = poses(platform)
    found, kernel = leg_motion(platform.hexapod, pose, DIRECTION), leg_rows(platform.hexapod, pose, DIRECTION)
    np.testing.assert_allclose(found.extension, kernel["extensions"], atol=1e-14)
    np.testing.assert_allclose(kernel["pose"], pose, atol=1e-11)
    np.testing.assert_allclose(found.rate, kernel["rates"], atol=1e-13)
    np.testing.assert_allclose(found.clearance, plain.clearance(MachineModel.of(platform), pose), rtol=1e-10)


def test_rotations_are_scipys_and_turn_about_their_axes():
    angles, rates, h = 0.5 * DIRECTION[:, :3], DIRECTION[:, 3:], 1e-6
    np.testing.assert_allclose(rotation(angles), Rotation.from_euler("XYZ", angles).as_matrix(), atol=1e-14)
    ahead, behind = (Rotation.from_euler("XYZ", angles + sign * h * rates) for sign in (1.0, -1.0))
    omega = (ahead * behind.inv()).as_rotvec() / (2.0 * h)
    np.testing.assert_allclose((turning_axes(angles) @ rates[..., None])[..., 0], omega, atol=1e-8)


@every_preset
def test_leg_rates_are_the_derivative_of_the_lengths(platform):
    pose, h = poses(platform), 1e-6
    ahead, behind = (legs_of_pose(platform.hexapod, pose + sign * h * DIRECTION) for sign in (1.0, -1.0))
    found = leg_rows(platform.hexapod, pose, DIRECTION)["rates"]
    np.testing.assert_allclose(found, (ahead - behind) / (2.0 * h), atol=1e-8)


@every_preset
def test_platform_rates_undo_leg_rates(platform):
    found = leg_rows(platform.hexapod, poses(platform), DIRECTION)
    np.testing.assert_allclose(found["back"], DIRECTION, atol=1e-12)


@every_preset
def test_determinant_is_that_of_the_whole_jacobian(platform):
    found = leg_rows(platform.hexapod, poses(platform), DIRECTION)
    whole = np.concatenate([found["u"], found["w"]], axis=2)
    np.testing.assert_allclose(found["determinant"], np.linalg.det(whole), rtol=1e-10)
    _, reference = plain.linearize(MachineModel.of(platform), poses(platform))
    np.testing.assert_allclose(whole, reference, atol=1e-14)


@every_preset
def test_neutral_is_where_the_legs_are_neutral(platform):
    legs = platform.hexapod
    np.testing.assert_allclose(legs_of_pose(legs, np.zeros(6)), 0.0, atol=1e-15)
    np.testing.assert_allclose(pose_of_legs(legs, np.zeros(6), guess=[0.02] * 6), 0.0, atol=1e-12)


def test_batches_are_rows():
    legs, pose = PRESETS["paper"].hexapod, poses(PRESETS["paper"])
    lengths = legs_of_pose(legs, pose)
    assert lengths.shape == pose.shape
    np.testing.assert_array_equal(lengths[3], legs_of_pose(legs, pose[3]))
    np.testing.assert_allclose(pose_of_legs(legs, lengths), pose, atol=1e-11)


REACH = {
    "x": (0, [1.425, -1.130]),
    "y": (1, [1.183, -1.183]),
    "z": (2, [0.791, -0.736]),
    "roll": (3, np.radians([30.0, -30.0])),
    "pitch": (4, np.radians([28.5, -27.8])),
    "yaw": (5, np.radians([49.0, -49.0])),
}
"""Single-axis envelope of the paper's machine, computed elsewhere; rounded to mm and about half a degree."""


@pytest.mark.parametrize("axis", REACH)
def test_envelope_of_the_papers_machine(axis):
    index, ends = REACH[axis]
    legs = legs_of_pose(PRESETS["paper"].hexapod, np.outer(ends, np.eye(6)[index]))
    np.testing.assert_allclose(np.abs(legs).max(axis=1), 0.67, atol=0.015)


def test_legs_that_cannot_close_are_refused():
    with pytest.raises(GeometryError, match="cannot close"):
        pose_of_legs(PRESETS["paper"].hexapod, [3.0, -2.0, 3.0, -2.0, 3.0, -2.0])


@pytest.mark.parametrize("bad", [[0.0] * 5, [0.0] * 5 + [np.nan], [[[0.0] * 6]], 1.0])
def test_broken_poses_are_refused(bad):
    with pytest.raises(DataError, match=r"pose (must be 6 numbers|is not finite)"):
        legs_of_pose(PRESETS["paper"].hexapod, bad)
    with pytest.raises(DataError, match=r"extensions (must be 6 numbers|is not finite)"):
        pose_of_legs(PRESETS["paper"].hexapod, bad)
