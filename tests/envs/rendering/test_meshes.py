"""Solids: closed, facing outwards, of the volume geometry gives them; legs end at their joints."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.envs.platform import get_platform, platform_names
from motion_cueing.envs.rendering import theme
from motion_cueing.envs.rendering.drawing import (
    Mesh,
    along,
    box,
    circle,
    cylinder,
    joined,
    prism,
    shaded,
    sphere,
)
from motion_cueing.envs.rendering.machine_model import Legs, joints, leg_use, machine_parts, tubes
from motion_cueing.envs.rendering.surroundings import shell

from .moments import moment

GREY = (100, 100, 100)


def volume(mesh: Mesh) -> float:
    """By the divergence theorem: positive and right only if the surface is closed and faces outwards."""
    a, b, c, d = (mesh.vertices[mesh.faces[:, k]] for k in range(4))
    return float(np.sum(np.cross(a, b) * c + np.cross(a, c) * d) / 6.0)


def test_volumes():
    assert volume(box((-1.0, 0.0, 2.0), (1.0, 3.0, 2.5), GREY)) == pytest.approx(3.0)
    for n in (3, 5, 6, 24):
        area = 0.5 * n * np.sin(2.0 * np.pi / n)
        assert volume(prism(circle(1.0, n), -2.0, 0.0, GREY)) == pytest.approx(2.0 * area)
    solid = cylinder((1.0, 2.0, 3.0), (1.0, 4.0, 3.0), 0.5, GREY, sides=40)
    assert volume(solid) == pytest.approx(2.0 * np.pi * 0.25, rel=0.01)
    assert volume(sphere(1.0, GREY, sides=60)) == pytest.approx(4.0 / 3.0 * np.pi, rel=0.02)
    assert volume(shell()) > 4.0  # the body of a small car, m^3
    assert volume(joined(box((0, 0, 0), (1, 1, 1), GREY), sphere(1.0, GREY))) == pytest.approx(
        1.0 + volume(sphere(1.0, GREY))
    )


@pytest.mark.parametrize("name", platform_names())
def test_every_solid_part_of_every_machine_faces_outwards(name):
    parts = machine_parts(get_platform(name))
    solids = [
        parts.rails,
        parts.bridge,
        parts.carriage,
        parts.platform,
        parts.turntable,
        *parts.cab.wheels[0],
    ]
    for mesh in (mesh for mesh in solids if mesh is not None):
        assert volume(mesh) > 0.0


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (0.0, 0.0, -2.0), (1.0, 0.0, 0.0), (-1.0, 2.0, 0.5)])
def test_along_is_a_rotation_that_takes_z_to_the_direction(direction):
    vector = np.array(direction)
    turn = along(vector)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    np.testing.assert_allclose(turn[:, 2], vector / np.linalg.norm(vector))


@pytest.mark.parametrize("name", platform_names())
def test_legs_end_at_their_joints_and_never_shrink_below_the_barrel(name):
    platform = get_platform(name)
    legs = Legs.of(platform.hexapod, scale=1.0)
    motion = moment(platform, (0.05, -0.04, 0.03, 0.05, 0.08, -0.1), (2.0, 1.0))
    lower, upper = joints(platform, motion)
    barrels = tubes(lower, upper, 0.05, np.zeros((6, 3)), 0.0).vertices.reshape(6, -1, 3)
    rings = barrels.reshape(6, 4, -1, 3).mean(axis=2)
    np.testing.assert_allclose(rings[:, 0], lower, atol=1e-12)
    np.testing.assert_allclose(rings[:, -1], upper, atol=1e-12)
    drawn = legs.mesh(lower, upper, leg_use(platform, motion)).vertices
    for joint in (*lower, *upper):
        assert np.linalg.norm(drawn - joint, axis=1).min() < 0.12
    shortest = platform.hexapod.neutral_lengths.min() + platform.hexapod.extension[0]
    assert 0.0 < legs.barrel < shortest


def test_faces_towards_the_lamp_are_brighter_and_never_black():
    cube = box((-1, -1, -1), (1, 1, 1), GREY)
    normals = np.stack([theme.LIGHT, -theme.LIGHT, *np.zeros((4, 3))])
    light = shaded(cube, normals, np.tile([0.0, 0.0, -1.0], (6, 1)))
    assert light[0, 0] > light[1, 0] > 20.0


def test_use_is_green_then_amber_then_red():
    green, amber, red = (theme.color_of_use(use) for use in (0.2, -0.8, 1.7))
    assert green == theme.color_of_use(0.0)
    assert green[1] > green[0]
    assert amber[0] > amber[1] > amber[2]
    assert red[0] > 2 * red[1]
