"""Limits that brake with bounded jerk: no kick at an end, no limit broken, no change while there is room."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from scipy.integrate import solve_ivp

from motion_cueing.envs.arrays import real
from motion_cueing.envs.platform import Braking, Platform, load_platform
from motion_cueing.envs.platform.kernels.step import EASED, SINGULAR, eased_acceleration
from motion_cueing.envs.platform.parameters import braking_jerk
from motion_cueing.envs.platform.randomization import PlatformRanges, random_platform
from motion_cueing.envs.settings import save

from .platforms_under_test import DT, PRESETS
from .storms import Watch, simulator, storm
from .test_braking import along, push

JERK = 150.0
BAR = 3.0
"""Step of the felt force in 10 ms that a person can bear, m/s^2."""
RANGES = PlatformRanges(
    travel=(0.5, 1.5), size=(0.6, 1.5), shape=(0.8, 1.2), rates=(0.5, 1.5),
    limited_turntable=0.5, without_carriage=0.3, without_turntable=0.3,
)  # fmt: skip


def gentle(platform: Platform, jerk: float | None = JERK) -> Platform:
    return replace(platform, braking=Braking(jerk))


def machines() -> dict[str, Platform]:
    rng = np.random.default_rng(11)
    drawn = {f"random {k}": random_platform(PRESETS["paper"], RANGES, rng, f"random {k}") for k in range(4)}
    return {name: gentle(platform) for name, platform in (PRESETS | drawn).items()}


@pytest.mark.slow
@pytest.mark.parametrize("name", machines())
@pytest.mark.parametrize("scale", [2.0, 20.0, 1e6])
def test_no_storm_breaks_a_limit_or_kicks(name, scale):
    platform, n = machines()[name], 32
    watch, batch = Watch(platform, 1e-9), simulator(platform, n)
    batch.reset()
    limited, kicks = 0, 0
    for k, action in enumerate(storm(n, 300, scale, seed=2)):
        before = batch.state["simulator_cue"]["force"].copy()
        state = batch.step(action)
        watch.check(state)
        now = state["limits"] != 0
        if k > 0:
            steps = np.linalg.norm(state["simulator_cue"]["force"] - before, axis=1)
            singular = now & (state["limits"] & np.uint64(SINGULAR) != 0)
            assert steps[now & ~singular].max(initial=0.0) <= BAR, k
            # Before a singular pose the legs may have to brake with all they have.
            kicks += int(np.sum(steps[singular] > BAR))
            limited += int(now.sum())
    assert limited > 100
    assert kicks <= 1e-3 * limited


@pytest.mark.parametrize("name", PRESETS)
def test_nothing_changes_while_there_is_room(name):
    plain, eased = (simulator(platform, 4) for platform in (PRESETS[name], gentle(PRESETS[name])))
    plain.reset()
    eased.reset()
    rng = np.random.default_rng(3)
    for k in range(150):
        # Accelerations that jump, so that only the ends could hold them back.
        action = 0.05 * rng.normal(size=(4, 9)) * (1 + k % 3)
        np.testing.assert_array_equal(plain.step(action), eased.step(action))
        assert not eased.state["limits"].any()


@pytest.mark.parametrize("axis", ["carriage_x", "turntable"])
@pytest.mark.parametrize("acceleration", [0.3, 2.0, 1e3])
def test_an_end_is_met_without_a_kick(axis, acceleration):
    platform = gentle(PRESETS["paper" if axis == "carriage_x" else "24-inch"])
    i = 0 if axis == "carriage_x" else 8
    path = push(platform, along(axis, acceleration), 1500)[:, :, i]
    change = np.diff(np.diff(path[:, 1], prepend=0.0)) / DT
    most = braking_jerk(platform)[i] * DT
    # Braking never sets in harder; it ends in a last step that is not a whole one.
    assert change.min() >= -most * (1.0 + 1e-9)
    assert change.max() <= 1.8 * most
    assert abs(path[-1, 1]) < 1e-9


def stopping_way(speed: float, acceleration: float, jerk: float) -> float:
    """From a cruise to rest: the acceleration falls to its peak, stays, and returns; integrated in time."""
    ramp = min(acceleration / jerk, np.sqrt(speed / jerk))
    hold = max(speed / acceleration - acceleration / jerk, 0.0)
    end = 2.0 * ramp + hold

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -jerk * min(t, ramp, max(end - t, 0.0))]

    return float(solve_ivp(rates, (0.0, end), [0.0, speed], rtol=1e-9, atol=1e-9, max_step=0.01).y[0, -1])


@pytest.mark.parametrize("speed", [0.5, 3.0, 5.5])
def test_braking_begins_no_earlier_than_it_must(speed):
    platform = gentle(PRESETS["paper"])
    assert platform.carriage is not None
    batch = simulator(platform, 1)
    batch.reset()
    path, greatest = [], platform.carriage.acceleration
    while batch.state["motion"]["rate"][0, 0] < speed - 1e-9:
        left = (speed - batch.state["motion"]["rate"][0, 0]) / DT
        batch.step(along("carriage_x", min(left, 2.0)))
    for _ in range(3200):
        state = batch.step(np.zeros((1, 9)))
        path.append((state["motion"]["position"][0, 0], state["limits"][0]))
    begins = next(q for q, limits in path if limits)
    way = stopping_way(speed, greatest, braking_jerk(platform)[0])
    room = platform.carriage.travel_x[1] - begins
    assert way - 2.0 * speed * DT <= room <= way + 2.0 * speed * DT
    # A command of no acceleration lets it drift on, ever more slowly.
    assert 0.0 <= platform.carriage.travel_x[1] - path[-1][0] < 0.1


def test_a_machine_let_go_approaches_its_command_with_bounded_jerk():
    platform = gentle(PRESETS["paper"])
    batch = simulator(platform, 1)
    push(platform, along("surge", 5.0), 300)
    force, eased = [batch.state["simulator_cue"]["force"][0].copy()], 0
    for _ in range(15):
        state = batch.step(along("surge", -3.0))
        force.append(state["simulator_cue"]["force"][0].copy())
        eased += int(state["limits"][0] >> np.uint64(EASED.bit_length() - 1)) & 1
    assert np.linalg.norm(np.diff(force, axis=0), axis=1).max() <= 1.5 * 1.2
    assert 0 < eased < 10
    assert state["limits"][0] == 0


@wp.kernel
def accelerate(room: wp.array(dtype=real), speed: wp.array(dtype=real), out: wp.array(dtype=real)) -> None:
    i = wp.tid()
    out[i] = eased_acceleration(room[i], speed[i], real(6.0), real(100.0), real(0.01))


def test_the_gradient_of_braking_is_that_of_differences():
    # Before braking, in its middle at the limit of acceleration, and shortly before rest.
    room, speed = np.array([0.3, 0.05, 1.6, 0.002]), np.array([1.5, 0.4, 4.0, 0.05])

    def value(r: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
        arrays = [wp.array(x, dtype=real, device="cpu", requires_grad=True) for x in (r, v)]
        out = wp.zeros(len(r), dtype=real, device="cpu", requires_grad=True)
        with wp.Tape() as tape:
            wp.launch(accelerate, len(r), inputs=arrays, outputs=[out], device="cpu")
        tape.backward(grads={out: wp.full(len(r), 1.0, dtype=real, device="cpu")})
        return out.numpy(), [array.grad.numpy() for array in arrays]

    _, gradients = value(room, speed)
    h = 1e-5
    for gradient, (dr, dv) in zip(gradients, ((h, 0.0), (0.0, h)), strict=True):
        difference = (value(room + dr, speed + dv)[0] - value(room - dr, speed - dv)[0]) / (2.0 * h)
        np.testing.assert_allclose(gradient, difference, rtol=1e-3)


def test_the_bound_is_kept_at_neutral_in_every_combination():
    platform = gentle(PRESETS["paper"])
    batch = simulator(platform, 1)
    batch.reset()
    legs = braking_jerk(platform)[2]
    # Heave alone: all legs alike. Their jerk is felt as less than the bound.
    state = batch.step(along("heave", 1.0))
    rates = state["motion"]["rate"][0, 2:8] / DT
    assert 0.0 < legs / np.abs(rates).max() <= JERK


def test_a_file_sets_the_bound(tmp_path):
    save(gentle(PRESETS["dim-hexapod"], 80.0), tmp_path / "mine.yaml")
    assert load_platform(tmp_path / "mine.yaml").braking == Braking(80.0)
    assert PRESETS["dim-hexapod"].braking.jerk is None
