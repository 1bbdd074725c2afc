"""The sinusoids of the frequency response: whole periods, the test's amplitudes, derivatives, gravity."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.evaluation.frequency_response.response import (
    OMCT_FREQUENCIES,
    FrequencyTest,
    harmonic,
    probe,
    swelling_sine,
)
from motion_cueing.evaluation.metrics import CUE_AXES

DT = 0.01


@settings(max_examples=50, deadline=None)
@given(
    st.floats(-3.0, 3.0),
    st.floats(-3.0, 3.0),
    st.floats(-5.0, 5.0),
    st.floats(-0.1, 0.1),
    st.integers(1, 9),
)
def test_the_harmonic_of_a_sinusoid_on_a_line_is_found_exactly(sine, cosine, offset, slope, periods):
    n = 720
    frequency = 2.0 * math.pi * periods / (n * DT)
    time = DT * np.arange(n)
    values = offset + slope * time + sine * np.sin(frequency * time) + cosine * np.cos(frequency * time)
    found, explained = harmonic(values[:, None], frequency, DT)
    assert found[0] == pytest.approx(sine + 1j * cosine, abs=1e-8)
    if abs(found[0]) > 1e-2:
        assert explained[0] == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("frequency", OMCT_FREQUENCIES)
def test_whole_periods_are_whole_samples(frequency):
    one = probe("w_y", frequency, FrequencyTest())
    periods = one.frequency * one.samples * DT / (2.0 * math.pi)
    assert periods == pytest.approx(round(periods), abs=1e-9)
    assert periods >= 2.0 - 1e-9
    assert one.frequency == pytest.approx(frequency, rel=1e-3)
    assert len(one.cues) * DT >= 60.0 + one.samples * DT


def test_the_frequencies_are_the_tests_five_a_decade():
    np.testing.assert_allclose(OMCT_FREQUENCIES, 0.1 * 10.0 ** (0.2 * np.arange(12)), rtol=2e-4)


def test_amplitudes_are_the_tests():
    """1 m/s^2; 6 degrees up to a sixth of a rad/s, 1 deg/s from there."""
    test = FrequencyTest()
    assert test.amplitude("f_y", 3.0) == 1.0
    assert test.amplitude("w_x", 0.1) == pytest.approx(math.radians(0.6))
    assert test.amplitude("w_x", 2.0) == pytest.approx(math.radians(1.0))
    assert FrequencyTest(scale=0.1).amplitude("f_x", 1.0) == pytest.approx(0.1)
    one = probe("w_z", 2.0, test)
    assert np.abs(one.cues.angular_velocity[-one.samples :, 2]).max() == pytest.approx(
        math.radians(1.0), rel=1e-3
    )
    np.testing.assert_array_equal(one.cues.specific_force[0], [0.0, 0.0, -9.81])


def test_derivatives_of_the_swelling_sine_belong_together():
    time = 1e-4 * np.arange(60_000)
    angle, rate, acceleration = swelling_sine(time, 7.0, 3.0)
    np.testing.assert_allclose(np.gradient(angle, time)[1:-1], rate[1:-1], atol=1e-5)
    np.testing.assert_allclose(np.gradient(rate, time)[1:-1], acceleration[1:-1], atol=1e-4)
    assert (angle[0], rate[0], acceleration[0]) == (0.0, 0.0, 0.0)
    np.testing.assert_allclose(angle[30_000:], np.sin(7.0 * time[30_000:]), atol=1e-12)


def test_a_tilted_car_feels_gravity():
    """Nose up presses backward into the seat: f_x > 0; right side down gives f_y < 0; |f| = g."""
    for axis, column, sign in (("w_y", 0, 1.0), ("w_x", 1, -1.0)):
        one = probe(axis, 0.5, FrequencyTest(gravity=True))
        angle = np.cumsum(one.cues.angular_velocity[:, CUE_AXES.index(axis) - 3]) * DT
        force = one.cues.specific_force
        np.testing.assert_allclose(force[:, column], sign * 9.81 * np.sin(angle), atol=2e-3)
        np.testing.assert_allclose(np.linalg.norm(force, axis=1), 9.81, atol=1e-9)


@pytest.mark.parametrize("values", [{"frequencies": (0.0,)}, {"frequencies": (100.0,)}, {"scale": -1.0}])
def test_a_test_that_cannot_be_is_refused(values):
    with pytest.raises(ConfigurationError):
        FrequencyTest(**values)
