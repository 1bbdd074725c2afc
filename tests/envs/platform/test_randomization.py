"""What a hexapod reaches, and machines of other builds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import Platform
from motion_cueing.envs.platform.kinematics import axis_reach, legs_of_pose, pose_of_legs
from motion_cueing.envs.platform.parameters import machine_parameters
from motion_cueing.envs.platform.randomization import PlatformRanges, random_platform, resized

from .platforms_under_test import DT, PRESETS

PAPER = PRESETS["paper"]
WIDE = PlatformRanges(
    travel=(0.3, 1.2),
    size=(0.3, 1.2),
    shape=(0.8, 1.25),
    rates=(0.5, 2.0),
    limited_turntable=0.5,
    without_carriage=0.3,
    without_turntable=0.2,
)


def drawn(ranges: PlatformRanges, seed: int = 0, platform: Platform = PAPER) -> Platform:
    return random_platform(platform, ranges, np.random.default_rng(seed), "drawn")


def clearance(hexapod, pose: np.ndarray) -> float:
    """det(J) over that of neutral, J by differences: Euler rates are angular velocity but for cos(pitch)."""

    def determinant(at: np.ndarray) -> float:
        steps = 1e-6 * np.eye(6)
        return float(np.linalg.det(legs_of_pose(hexapod, at + steps) - legs_of_pose(hexapod, at - steps)))

    return determinant(pose) / determinant(np.zeros(6)) / np.cos(pose[4])


@pytest.mark.parametrize("name", PRESETS)
def test_reach_ends_where_a_leg_does_or_near_a_singular_pose(name):
    hexapod = PRESETS[name].hexapod
    low, high = hexapod.extension
    for axis, ways in enumerate(axis_reach(hexapod)):
        for sign, distance in zip((-1.0, 1.0), ways, strict=True):
            poses = np.zeros((60, 6))
            poses[:, axis] = sign * distance * np.linspace(0.0, 1.0, 60)
            legs = legs_of_pose(hexapod, poses)
            assert legs.min() >= low - 1e-9
            assert legs.max() <= high + 1e-9
            beyond = legs_of_pose(hexapod, 1.00001 * poses[-1])
            at_its_end = beyond.min() < low or beyond.max() > high
            assert at_its_end or clearance(hexapod, poses[-1]) == pytest.approx(0.15, rel=1e-3)


@settings(max_examples=25)
@given(st.floats(0.2, 4.0), st.sampled_from(["dim-hexapod", "24-inch"]))
def test_a_hexapod_of_another_size_is_similar(size, name):
    """Where the origin of F_H is the middle of its joints, as here; angles are about that origin."""
    own = PRESETS[name].hexapod
    other = resized(own, size)
    np.testing.assert_allclose(other.neutral_lengths, size * own.neutral_lengths, rtol=1e-12)
    scale = np.array([[size], [size], [size], [1.0], [1.0], [1.0]])
    np.testing.assert_allclose(axis_reach(other), scale * axis_reach(own), rtol=1e-6)


def test_each_factor_of_shape_changes_its_part():
    own = PAPER.hexapod
    other = resized(own, 1.0, upper=1.2, lower=0.9, height=1.1)
    spread = [np.std(h, axis=0)[:2] for h in (own.upper_joints, other.upper_joints)]
    np.testing.assert_allclose(spread[1], 1.2 * spread[0], rtol=1e-12)
    spread = [np.std(h, axis=0)[:2] for h in (own.lower_joints, other.lower_joints)]
    np.testing.assert_allclose(spread[1], 0.9 * spread[0], rtol=1e-12)
    middles = [np.mean(hexapod.upper_joints, axis=0) for hexapod in (own, other)]
    np.testing.assert_allclose(*middles, atol=1e-12)
    assert other.neutral[2] == pytest.approx(1.1 * own.neutral[2])
    assert other.extension == own.extension


@settings(max_examples=40)
@given(st.integers(0, 2**31), st.sampled_from(list(PRESETS)))
def test_every_drawn_machine_closes_at_neutral_and_moves(seed, name):
    own = PRESETS[name]
    made = drawn(WIDE, seed, own)
    machine_parameters(made, DT)
    np.testing.assert_allclose(pose_of_legs(made.hexapod, np.zeros(6)), np.zeros(6), atol=1e-9)
    assert np.all(axis_reach(made.hexapod) > 0.0)
    assert made.hexapod.neutral_lengths.min() + made.hexapod.extension[0] > 0.0
    assert made.hexapod not in [preset.hexapod for preset in PRESETS.values()]
    assert made.cab == own.cab
    for part in ("carriage", "turntable"):
        assert getattr(own, part) is not None or getattr(made, part) is None
    rates = [
        getattr(theirs, limit) / getattr(ours, limit)
        for theirs, ours in (
            (getattr(made, p), getattr(own, p)) for p in ("carriage", "hexapod", "turntable")
        )
        if theirs is not None
        for limit in ("velocity", "acceleration")
    ]
    assert len(set(rates)) == len(rates)
    assert all(0.5 - 1e-12 <= rate <= 2.0 + 1e-12 for rate in rates)


def test_shares_of_subsystems_are_those_asked_for():
    rng, count = np.random.default_rng(3), 1000
    machines = [random_platform(PAPER, WIDE, rng, "drawn") for _ in range(count)]
    tables = [machine.turntable for machine in machines if machine.turntable]
    limited = [table.travel for table in tables if table.travel]
    for found, share, among in (
        (sum(machine.carriage is None for machine in machines), 0.3, count),
        (count - len(tables), 0.2, count),
        (len(limited), 0.5, len(tables)),
    ):
        assert abs(found - share * among) < 4.0 * np.sqrt(share * (1.0 - share) * among)
    assert all(low == -high and 0.5 * np.pi <= high <= 2.0 * np.pi for low, high in limited)


def test_without_ranges_only_the_name_differs():
    made = drawn(PlatformRanges())
    np.testing.assert_allclose(made.hexapod.upper_joints, PAPER.hexapod.upper_joints, atol=1e-12)
    np.testing.assert_allclose(made.hexapod.neutral, PAPER.hexapod.neutral, atol=1e-12)
    assert made.carriage == PAPER.carriage
    assert made.turntable == PAPER.turntable
    assert made.name == "drawn"


def test_machines_that_never_close_are_refused():
    with pytest.raises(ConfigurationError, match=r"none of 100 machines drawn around 'paper' closes.*narrow"):
        drawn(PlatformRanges(travel=(9.0, 10.0)))
    # Some of these close, and are found.
    assert (
        drawn(PlatformRanges(travel=(1.0, 10.0))).hexapod.extension[1] < PAPER.hexapod.neutral_lengths.min()
    )


def test_ranges_run_from_low_to_high():
    with pytest.raises(
        ConfigurationError, match=r"size must be a range from low to high, found \[2.0, 1.0\]"
    ):
        replace(WIDE, size=(2.0, 1.0))
    with pytest.raises(ConfigurationError, match="without_carriage"):
        replace(WIDE, without_carriage=1.5)
