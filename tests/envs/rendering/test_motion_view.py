"""Frames and joints of what is drawn, against elementary rotations and the kinematics."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.envs.errors import DataError
from motion_cueing.envs.platform import get_platform, legs_of_pose, platform_names
from motion_cueing.envs.rendering.machine_model import (
    MotionView,
    head,
    joints,
    leg_use,
    neutral_view,
    rotation,
    turntable_frame,
)

from ...reference import frames
from .moments import moment

angles = st.floats(-0.4, 0.4)
shifts = st.floats(-0.3, 0.3)
poses = st.tuples(shifts, shifts, shifts, angles, angles, angles)


@given(st.tuples(angles, angles, st.floats(-4.0, 4.0)))
def test_rotation_is_the_product_of_elementary_rotations(beta):
    expected = frames.rotation(np.array(beta)[None])[0]
    np.testing.assert_allclose(rotation(np.array(beta)), expected, atol=1e-14)


@pytest.mark.parametrize("name", platform_names())
@given(pose=poses)
def test_drawn_legs_are_as_long_as_the_kinematics_say(name, pose):
    hexapod = get_platform(name).hexapod
    lower, upper = joints(get_platform(name), moment(get_platform(name), pose, (1.5, -2.0)))
    lengths = np.linalg.norm(upper - lower, axis=1)
    np.testing.assert_allclose(lengths - hexapod.neutral_lengths, legs_of_pose(hexapod, pose), atol=1e-9)


def test_lower_joints_go_with_the_carriage_alone():
    platform = get_platform("paper")
    lower, _ = joints(platform, moment(platform, (0.1, 0.2, -0.1, 0.1, 0.1, 0.2), (3.0, -4.0), 1.0))
    at_rest, _ = joints(platform, neutral_view())
    np.testing.assert_allclose(lower - at_rest, np.tile([3.0, -4.0, 0.0], (6, 1)))


def test_signs_of_roll_pitch_and_turntable():
    platform = get_platform("paper")

    def seen(pose=(0.0,) * 6, turntable=0.0):
        frame = turntable_frame(platform, moment(platform, pose, turntable=turntable))
        return frame(np.eye(3)) - frame.origin

    # z points down: a side that goes down gains z.
    assert seen((0.0, 0.0, 0.0, 0.1, 0.0, 0.0))[1, 2] > 0.0  # positive roll: right side down
    assert seen((0.0, 0.0, 0.0, 0.0, 0.1, 0.0))[0, 2] < 0.0  # positive pitch: nose up
    assert seen(turntable=0.1)[0, 1] > 0.0  # positive yaw: nose to the right


def test_the_head_turns_with_the_turntable_about_its_axis():
    platform = get_platform("paper")
    offset = np.array(platform.cab.reference_point) + np.array(platform.cab.head)
    x, y, z = offset
    turned = head(platform, moment(platform, turntable=np.pi / 2.0))
    np.testing.assert_allclose(turned - platform.hexapod.neutral, [-y, x, z], atol=1e-14)


def test_use_of_the_legs_is_a_share_of_each_direction():
    platform = get_platform("24-inch")
    low, high = platform.hexapod.extension
    legs = np.array([low, 0.5 * low, 0.0, 0.25 * high, high, 0.0])
    view = MotionView(np.zeros(2), np.zeros(6), 0.0, legs)
    np.testing.assert_allclose(leg_use(platform, view), [-1.0, -0.5, 0.0, 0.25, 1.0, 0.0])


@pytest.mark.parametrize(
    ("name", "values"),
    [("carriage", np.zeros(3)), ("hexapod", np.full(6, np.nan)), ("turntable", np.inf), ("legs", [0.0] * 5)],
)
def test_a_broken_motion_is_refused_by_name(name, values):
    fields = {"carriage": np.zeros(2), "hexapod": np.zeros(6), "turntable": 0.0, "legs": np.zeros(6)}
    with pytest.raises(DataError, match=name):
        MotionView(**(fields | {name: values}))
