"""The camera against a projection matrix, and clipping against its definition."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.rendering.drawing import NEAR, Camera, clip_near, clip_segments, load_pygame, orbit
from motion_cueing.envs.rendering.machine_model import joints
from motion_cueing.envs.rendering.renderer import Scene

from .moments import moment

numbers = st.floats(-5.0, 5.0)
CAMERA = orbit(np.array([1.0, 2.0, -1.0]), 12.0, -2.2, 0.3, 900.0, (440.0, 360.0))


def matrix_of(camera: Camera) -> np.ndarray:
    """3 x 4 projection of computer vision, K [R | t], from azimuth and elevation of the line of sight."""
    sight = camera.target - camera.position
    azimuth = np.arctan2(sight[1], sight[0])
    fall = np.arctan2(sight[2], np.hypot(sight[0], sight[1]))
    turn = np.array([[np.cos(azimuth), np.sin(azimuth), 0.0],
                     [-np.sin(azimuth), np.cos(azimuth), 0.0], [0.0, 0.0, 1.0]])  # fmt: skip
    tip = np.array([[np.cos(fall), 0.0, np.sin(fall)], [0.0, 1.0, 0.0], [-np.sin(fall), 0.0, np.cos(fall)]])
    forward_right_down = tip @ turn
    rotation = forward_right_down[[1, 2, 0]]
    intrinsic = np.array([[camera.focal, 0.0, camera.center[0]],
                          [0.0, camera.focal, camera.center[1]], [0.0, 0.0, 1.0]])  # fmt: skip
    return intrinsic @ np.column_stack([rotation, -rotation @ camera.position])


@given(st.tuples(numbers, numbers, numbers))
def test_projection_is_that_of_a_projection_matrix(point):
    u, v, w = matrix_of(CAMERA) @ [*point, 1.0]
    np.testing.assert_allclose(CAMERA.project(np.array(point)), [u / w, v / w], atol=1e-8)


def test_drawn_joints_project_like_the_matrix():
    platform = get_platform("paper")
    motion = moment(platform, (0.2, -0.1, 0.1, 0.1, -0.05, 0.2), (4.0, -3.0), 0.7)
    camera = Scene(platform, load_pygame()).camera(motion, 880, 720)
    points = np.concatenate(joints(platform, motion))
    homogeneous = np.column_stack([points, np.ones(12)]) @ matrix_of(camera).T
    pixels = camera.project(points)
    np.testing.assert_allclose(pixels, homogeneous[:, :2] / homogeneous[:, 2:], atol=1e-8)
    assert np.all((pixels > 0.0) & (pixels < [880.0, 720.0]))


def test_the_target_is_in_the_middle_and_up_is_up():
    np.testing.assert_allclose(CAMERA.project(CAMERA.target), CAMERA.center)
    above = CAMERA.project(CAMERA.target - [0.0, 0.0, 1.0])
    assert above[1] < CAMERA.center[1]
    assert abs(above[0] - CAMERA.center[0]) < 1e-9


def test_seen_from_behind_right_is_right():
    behind = orbit(np.zeros(3), 10.0, np.pi, 0.2, 800.0, (0.0, 0.0))
    assert behind.project(np.array([0.0, 1.0, 0.0]))[0] > 0.0
    assert behind.view(np.array([1.0, 0.0, 0.0]))[2] > behind.view(np.zeros(3))[2]


def test_a_square_across_the_near_plane_keeps_its_far_half():
    low, high = NEAR - 1.0, NEAR + 1.0
    square = np.array([[0.0, 0.0, low], [0.0, 0.0, high], [1.0, 0.0, high], [1.0, 0.0, low]])
    shift = np.array([0.0, 0.0, 5.0])
    clipped = clip_near(square)
    assert sorted(map(tuple, clipped)) == [
        (0.0, 0.0, NEAR), (0.0, 0.0, NEAR + 1.0), (1.0, 0.0, NEAR), (1.0, 0.0, NEAR + 1.0)
    ]  # fmt: skip
    assert len(clip_near(square - shift)) == 0
    np.testing.assert_array_equal(clip_near(square + shift), square + shift)


def test_segments_are_cut_where_they_meet_the_near_plane():
    start = np.array([[0.0, 0.0, NEAR - 1.0], [0.0, 0.0, NEAR + 1.0], [0.0, 0.0, 0.0]])
    end = np.array([[4.0, 0.0, NEAR + 3.0], [1.0, 0.0, NEAR + 2.0], [1.0, 0.0, 0.5 * NEAR]])
    a, b = clip_segments(start, end)
    np.testing.assert_allclose(a, [[1.0, 0.0, NEAR], [0.0, 0.0, NEAR + 1.0]])
    np.testing.assert_allclose(b, end[:2])
