"""Hexapods nobody builds: refused, or driven as hard as can be without pose and legs ever parting."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.envs.errors import GeometryError
from motion_cueing.envs.platform import Hexapod, get_platform, platform_names
from motion_cueing.envs.platform.kernels.step import HELD
from motion_cueing.envs.platform.kinematics import braking_stays_clear, check_geometry
from motion_cueing.envs.simulator.simulator import Simulator

from .odd_geometries import AGREE, accepted_machines, drive, lengths_of_poses
from .platforms_under_test import PRESETS, sluggish
from .storms import STANDSTILL


# `python -m benchmarks.odd_geometries` does the same with a thousand machines.
@pytest.mark.parametrize("actuators", [lambda machine: machine, sluggish], ids=["unity", "sluggish"])
def test_legs_and_pose_of_odd_machines_agree_in_every_step(actuators):
    rng = np.random.default_rng(60)
    machines = [actuators(machine) for machine in accepted_machines(60, rng)]
    worst, held = drive(machines, 200, rng)
    assert worst.max() <= AGREE
    # Emergency stops are for what the look ahead does not see; with unity actuators that is next to nothing.
    if actuators is not sluggish:
        assert np.count_nonzero(held) <= 1


def nearly_its_own_base(velocity: float) -> Hexapod:
    """The paper's hexapod, the lower joints all but those of the upper platform: condition 6e-3."""
    hexapod = get_platform("paper").hexapod
    upper, lower = np.array(hexapod.upper_joints), np.array(hexapod.lower_joints)
    joints = tuple(map(tuple, 0.98 * upper + 0.02 * lower))
    return replace(hexapod, lower_joints=joints, velocity=velocity)


def test_a_platform_nearly_its_own_base_is_refused():
    with pytest.raises(GeometryError, match=r"reaches a singular pose within 0\.01 s of neutral"):
        check_geometry(nearly_its_own_base(1.0))


def test_slow_legs_may_have_an_odd_geometry():
    check_geometry(nearly_its_own_base(1e-3))


@pytest.mark.parametrize("name", platform_names())
def test_shipped_machines_brake_clear_of_singular_poses(name):
    assert braking_stays_clear(get_platform(name).hexapod)


def test_legs_that_brake_slowly_need_a_look_ahead():
    hexapod = get_platform("paper").hexapod
    assert not braking_stays_clear(replace(hexapod, velocity=5.0, acceleration=1.0))


def test_a_pose_that_cannot_close_is_held_and_the_legs_stop():
    # A lagging hexapod whose set-point is far off: made here by moving the state, as no command leads there.
    machine = sluggish(PRESETS["paper"])
    batch = Simulator(machine, STANDSTILL, drive_of=np.zeros(1, dtype=int))
    batch.reset()
    state = batch.state
    legs = [2.5, -2.0, 2.5, -2.0, 2.5, -2.0]
    state["motion"]["position"][0, 2:8] = legs
    before = state["motion"][0].copy()
    after = batch.step(np.zeros(9))
    assert after["limits"][0] & np.uint64(HELD)
    motion = after["motion"][0]
    np.testing.assert_array_equal(motion["displacement"], before["displacement"])
    np.testing.assert_array_equal(motion["beta"], before["beta"])
    np.testing.assert_array_equal(motion["rate"][2:8], 0.0)
    assert np.isfinite(lengths_of_poses([machine], np.zeros((1, 6)))).all()
