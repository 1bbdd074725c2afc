"""The filter blocks against SciPy's bilinear transform, and the tilt limiter against its limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from .probes import DT, run_high_pass, run_low_pass, run_tilt


def bilinear(numerator, denominator, u: np.ndarray) -> np.ndarray:
    b, a = signal.bilinear(numerator, denominator, 1.0 / DT)
    return signal.lfilter(b, a, u)


@pytest.mark.parametrize(("order", "damping"), [(1, 1.0), (2, 1.0), (2, 0.6)])
@pytest.mark.parametrize("w", [0.05, 0.6, 2.5])
def test_a_high_pass_is_the_bilinear_transform_of_its_transfer_function(order, damping, w):
    u = np.random.default_rng(1).normal(size=3000)
    numerator = [1.0] + [0.0] * order
    denominator = [1.0, w] if order == 1 else [1.0, 2.0 * damping * w, w * w]
    expected = bilinear(numerator, denominator, u)
    np.testing.assert_allclose(run_high_pass(order, w, damping, u)[:, 2], expected, atol=1e-9)


def test_an_open_block_passes_everything():
    u = np.array([1.0, -2.0, 3.0])
    np.testing.assert_array_equal(run_high_pass(0, 0.7, 1.0, u)[:, 2], u)


def test_a_double_integrated_second_order_high_pass_does_not_drift():
    """A constant input leaves the static position u / w^2 and no speed, for ever."""
    position, velocity, _ = run_high_pass(2, 1.0, 1.0, np.full(600_000, 0.7))[-1]
    assert position == pytest.approx(0.7, abs=1e-9)
    assert velocity == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("damping", [0.8, 1.0])
def test_the_low_pass_is_the_bilinear_transform_of_its_transfer_function(damping):
    w, u = 5.0, np.random.default_rng(2).normal(size=2000)
    position = np.concatenate([[0.0], run_low_pass(w, damping, u)[:, 0]])
    expected = bilinear([w * w], [1.0, 2.0 * damping * w, w * w], u)
    np.testing.assert_allclose(0.5 * (position[1:] + position[:-1]), expected, atol=1e-9)


@settings(max_examples=60, deadline=None)
@given(st.floats(0.001, 0.4), st.floats(0.01, 0.1), st.floats(0.05, 0.5))
def test_a_tilt_step_is_limited_and_does_not_overshoot(step, rate_limit, acceleration_limit):
    rows = run_tilt(rate_limit, acceleration_limit, np.full(6000, step), np.zeros(6000))
    assert np.abs(rows[:, 1]).max() <= rate_limit * (1 + 1e-12)
    assert np.abs(rows[:, 2]).max() <= acceleration_limit * (1 + 1e-12)
    assert rows[:, 0].max() <= step * (1 + 1e-6) + 1e-9
    assert rows[-1, 0] == pytest.approx(step, rel=1e-3)


def test_a_slow_tilt_target_is_followed_closely():
    time = np.arange(3000) * DT
    rows = run_tilt(0.05, 0.14, 0.05 * np.sin(0.5 * time), 0.025 * np.cos(0.5 * time))
    np.testing.assert_allclose(rows[300:-1, 0], 0.05 * np.sin(0.5 * time[301:]), atol=2e-5)
