"""The adaptive washout: without adaptation the classical one; its sensitivities; its steepest descent."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from motion_cueing.baselines.washout import ClassicalWashout, HighPass, WashoutParameters
from motion_cueing.baselines.washout.adaptive import (
    Adaptation,
    AdaptiveParameters,
    AdaptiveWashout,
)
from motion_cueing.baselines.washout.batch import WashoutBatch
from motion_cueing.baselines.washout.families import load_of
from motion_cueing.envs.errors import ConfigurationError, UnknownNameError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import save, to_dict
from motion_cueing.evaluation import measure, rollout

from ..drives import DT, boundless, trace
from .memories import memories

pytestmark = pytest.mark.slow

PAPER = get_platform("paper")
START = load_of("adaptive", "adaptive")
OPEN = HighPass()


def ramped(t, *columns):
    """Nothing before 0.2 s, then the columns."""
    return np.clip((t - 0.2) / 1.0, 0.0, 1.0)[:, None] * np.column_stack(columns)


WEAVE = trace(
    6.0,
    lambda t: ramped(t, 0.5 * np.sin(2.0 * t), 1.2 * np.sin(0.8 * t)),
    lambda t: ramped(t, 0.05 * np.sin(t), 0.04 * np.cos(t), 0.2 * np.sin(0.7 * t)),
    name="weave",
)
"""Gentle enough that no limit is met."""


def adapting(base: AdaptiveParameters = START, **changes) -> AdaptiveParameters:
    return replace(base, adaptation=replace(base.adaptation, **changes))


STILL = adapting(force_speed=(0.0, 0.0, 0.0), rate_speed=(0.0, 0.0, 0.0))


def test_without_adaptation_it_is_the_classical_washout_to_the_bit():
    values = to_dict(STILL)
    del values["algorithm"], values["adaptation"]
    classical = rollout(ClassicalWashout(WashoutParameters(**values)), WEAVE, PAPER)
    still = rollout(AdaptiveWashout(STILL), WEAVE, PAPER)
    np.testing.assert_array_equal(still.action, classical.action)
    assert np.abs(still.action - rollout(AdaptiveWashout(START), WEAVE, PAPER).action).max() > 0.01


@pytest.mark.parametrize(("axis", "effect"), [(0, "forward"), (1, "sideways"), (2, "vertical")])
def test_the_effect_of_a_gain_is_that_of_differences(axis, effect):
    """dQ'/dp with everything on: turning, tilting, filtering in the cab and in the inertial frame."""
    h = 1e-4
    policy = AdaptiveWashout(STILL, boundless().cab)
    sides = []
    for side in (1.0, -1.0):
        gains = np.ones(3)
        gains[axis] += side * h
        sides.append(memories(policy, WEAVE, boundless(), gains={"force": gains}))
    found = memories(policy, WEAVE, boundless())[effect]
    for ours, theirs in (("position", "displacement"), ("velocity", "velocity")):
        difference = (sides[0]["washout"][theirs] - sides[1]["washout"][theirs]) / (2.0 * h)
        assert np.abs(difference).max() > 1e-3
        np.testing.assert_allclose(found[ours], difference, atol=1e-6)


def test_the_gain_on_a_force_follows_the_published_law():
    """One axis, no tilt: the ordinary differential equations of the law, by an adaptive Runge-Kutta."""
    w, zeta, speed = 0.8, 0.9, 1.5
    cost = Adaptation(displacement=(1.5, 1.0), velocity=(2.0, 1.0), force_departure=0.5)
    parameters = AdaptiveParameters(
        "law", tilt=None, hps=(OPEN, OPEN), hpi=(HighPass(2, w, zeta), OPEN, OPEN),
        adaptation=replace(cost, force_speed=(speed, 0.0, 0.0)),
    )  # fmt: skip

    def force(t):
        return 1.2 * np.clip(t - 0.2, 0.0, 1.0) * np.sin(1.7 * t)

    def law(t, s):
        x, v, d, d_rate, p = s
        f = force(t)
        a = p * f - 2.0 * zeta * w * v - w * w * x
        a_by = f - 2.0 * zeta * w * d_rate - w * w * d
        slope = x * d / 1.5**2 + v * d_rate / 2.0**2 - (f - a) * a_by / 0.6**2 + (p - 1.0) / 0.5**2
        return [v, a, d_rate, a_by, -speed * slope]

    drive = trace(6.0, lambda t: np.column_stack([force(t), 0.0 * t]))
    found = memories(AdaptiveWashout(parameters), drive, boundless())
    exact = solve_ivp(law, (0.0, 6.0), [0.0, 0.0, 0.0, 0.0, 1.0], rtol=1e-9, atol=1e-9, t_eval=drive.time)
    gain = found["gains"]["force"][:, 0]
    assert np.ptp(gain) > 0.2
    # A command answers the cue of a step later than the continuous law: first order in the time step.
    np.testing.assert_allclose(gain, exact.y[4, 1:], atol=0.02)
    np.testing.assert_allclose(found["washout"]["displacement"][:, 0], exact.y[0, 1:], atol=0.02)


def test_the_gain_on_a_rate_follows_the_published_law():
    w, speed, roll_off = 0.5, 2.0, 150.0
    parameters = AdaptiveParameters(
        "law", hpr=(OPEN, OPEN, HighPass(1, w)), rate_bandwidth=roll_off,
        adaptation=Adaptation(angle=(1.0, 1.0, 0.3), rate_departure=0.4, rate_speed=(0.0, 0.0, speed)),
    )  # fmt: skip

    def rate(t):
        return 0.15 * np.clip(t - 0.2, 0.0, 1.0) * np.sin(0.9 * t)

    def law(t, s):
        low, psi, psi_rate, low_by, by, by_rate, p = s
        high, high_by = p * rate(t) - w * low, rate(t) - w * low_by
        error = (rate(t) - psi_rate) / np.radians(3.0) ** 2
        slope = psi * by / 0.3**2 - error * by_rate + (p - 1.0) / 0.4**2
        turn, turn_by = roll_off * (high - psi_rate), roll_off * (high_by - by_rate)
        return [high, psi_rate, turn, high_by, by_rate, turn_by, -speed * slope]

    turning = trace(6.0, rate=lambda t: np.column_stack([0.0 * t, 0.0 * t, rate(t)]))
    found = memories(AdaptiveWashout(parameters), turning, boundless())["gains"]["rate"][:, 2]
    exact = solve_ivp(
        law, (0.0, 6.0), [0.0] * 6 + [1.0], rtol=1e-9, atol=1e-9, t_eval=turning.time, method="LSODA"
    )
    assert np.ptp(found) > 0.05
    np.testing.assert_allclose(found, exact.y[6, 1:], atol=0.02)


def test_without_a_cue_a_gain_goes_home_at_its_own_pace():
    """(p - 1) / (1 + dt G / departure^2) a step."""
    parameters = adapting(force_speed=(0.3, 0.3, 0.3), force_departure=0.4)
    gains = np.array([0.2, 1.4, 0.9])
    found = memories(AdaptiveWashout(parameters), trace(1.0), PAPER, gains={"force": gains})
    steps = np.arange(len(found))[:, None]
    expected = 1.0 + (gains - 1.0) / (1.0 + DT * 0.3 / 0.4**2) ** steps
    np.testing.assert_allclose(found["gains"]["force"], expected, rtol=1e-9)


def test_no_cue_however_large_throws_a_gain_beyond_its_limits_or_makes_it_swing():
    fierce = trace(4.0, lambda t: ramped(t, 8.0 * np.sin(3.0 * t), 8.0 * np.cos(2.0 * t)))
    fast = adapting(force_speed=(1e4,) * 3, rate_speed=(1e4,) * 3, gain_limits=(0.1, 1.2))
    found = memories(AdaptiveWashout(fast), fierce, PAPER)["gains"]
    for kind in ("force", "rate"):
        assert found[kind].min() >= 0.1
        assert found[kind].max() <= 1.2
        # A gain that swings goes up, down, up and so on for ever; one that follows the cue turns with it.
        turns = np.diff(np.sign(np.diff(found[kind], axis=0)), axis=0) != 0.0
        assert not np.any(turns[2:] & turns[1:-1] & turns[:-2])
    assert np.ptp(found["force"][:, :2], axis=0) == pytest.approx([1.1, 1.1])  # from limit to limit


def test_dear_displacement_lowers_the_gain():
    push = trace(6.0, lambda t: ramped(t, 2.0 * np.sin(0.8 * t), 2.0 * np.cos(0.7 * t)))
    means = []
    for scale in (0.3, 1.0, 3.0):
        parameters = adapting(displacement=(scale, 1.0), force=1e6)
        means.append(
            memories(AdaptiveWashout(parameters), push, boundless())["gains"]["force"][:, :2].mean(0)
        )
    assert (np.diff(means, axis=0) > 0.0).all()


def test_a_batch_has_the_scores_of_single_rollouts():
    sets = [START, STILL]
    scores = WashoutBatch(sets, [WEAVE], PAPER).scores()
    for i, parameters in enumerate(sets):
        metrics = measure(rollout(AdaptiveWashout(parameters), WEAVE, PAPER))
        assert scores.cue_error[i, 0] == pytest.approx(metrics.cue_error, rel=1e-9)
        assert scores.perceived_error[i, 0] == pytest.approx(metrics.perceived_cue_error, rel=1e-9)


def test_only_the_classical_washout_has_a_gradient():
    with pytest.raises(ConfigurationError, match="the adaptive washout has no gradient"):
        WashoutBatch([START], [WEAVE], PAPER).gradient(10)


@pytest.mark.parametrize("name", ["adaptive", "adaptive-tuned"])
def test_presets_round_trip_through_yaml_and_policies_can_be_copied(name, tmp_path):
    parameters = load_of("adaptive", name)
    save(parameters, tmp_path / "mine.yaml")
    assert load_of("adaptive", tmp_path / "mine.yaml") == parameters
    policy = AdaptiveWashout(name)
    assert policy.name == name
    assert copy.deepcopy(policy).parameters == parameters


def test_wrong_parameters_are_refused():
    with pytest.raises(ConfigurationError, match="gain_limits must hold 1, where the gains begin, found"):
        Adaptation(gain_limits=(0.1, 0.9))
    with pytest.raises(ConfigurationError, match="force_speed"):
        Adaptation(force_speed=(-1.0, 0.0, 0.0))
    with pytest.raises(UnknownNameError, match="Did you mean adaptive"):
        load_of("adaptive", "adaptiv")
