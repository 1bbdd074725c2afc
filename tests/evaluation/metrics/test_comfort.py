"""The weightings of ISO 2631-1 against the published table, SciPy's analog filters and closed forms."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest
from scipy import signal

from motion_cueing.evaluation.metrics import (
    WD,
    WF,
    WK,
    measure,
    motion_sickness_dose,
    vibration_total,
)

from ..synthetic import GRAVITY, drive, trajectory

DT = 0.01
REST = np.array([0.0, 0.0, -GRAVITY])
PUBLISHED = [
    (WK, {0.5: 0.418, 1.0: 0.482, 2.0: 0.531, 4.0: 0.967, 8.0: 1.036, 16.0: 0.769}),
    (WD, {0.5: 0.853, 1.0: 1.011, 2.0: 0.890, 4.0: 0.512, 8.0: 0.253}),
    (WF, {0.1: 0.695, 0.16: 1.006, 0.2: 0.992, 0.25: 0.854, 0.5: 0.224}),
]


def polynomials(low, high, f3, f4, q4, f5=None, q5=1.0, f6=1.0, q6=1.0):
    """Numerator and denominator in s of a weighting."""
    w = {name: 2.0 * pi * f for name, f in (("low", low), ("high", high), (3, f3), (4, f4), (6, f6))}
    numerator = np.polymul([w["high"] ** 2, 0.0, 0.0], [1.0 / w[3], 1.0])
    denominator = np.polymul(
        [1.0, sqrt(2.0) * w["low"], w["low"] ** 2], [1.0, sqrt(2.0) * w["high"], w["high"] ** 2]
    )
    denominator = np.polymul(denominator, [1.0 / w[4] ** 2, 1.0 / (q4 * w[4]), 1.0])
    if f5 is not None:
        w5 = 2.0 * pi * f5
        numerator = np.polymul(numerator, [1.0 / w5**2, 1.0 / (q5 * w5), 1.0]) * (f5 / f6) ** 2
        denominator = np.polymul(denominator, [1.0 / w[6] ** 2, 1.0 / (q6 * w[6]), 1.0])
    return numerator, denominator


ANALOG = [
    (WK, polynomials(0.4, 100.0, 12.5, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91)),
    (WD, polynomials(0.4, 100.0, 2.0, 2.0, 0.63)),
    (WF, polynomials(0.08, 0.63, np.inf, 0.25, 0.86, 0.0625, 0.80, 0.1, 0.80)),
]


@pytest.mark.parametrize(("weighting", "gains"), PUBLISHED)
def test_the_filter_at_100_hz_has_the_published_gains(weighting, gains):
    time = DT * np.arange(30_000)
    waves = np.sin(2.0 * pi * np.outer(time, list(gains)))
    settled = weighting.apply(waves, DT)[10_000:]
    assert sqrt(2.0) * settled.std(axis=0) == pytest.approx(list(gains.values()), rel=0.01)


@pytest.mark.parametrize(("weighting", "analog"), ANALOG)
def test_the_filter_at_100_hz_is_scipys_analog_one_in_gain_and_phase(weighting, analog):
    impulse = np.zeros((60_000, 1))
    impulse[1000] = 1.0
    frequency = np.array([0.05, 0.1, 0.3, 1.0, 3.0, 10.0, 20.0, 40.0])
    answer = weighting.apply(impulse, DT)[:, 0]
    kernel = np.exp(-2j * pi * np.outer(frequency, DT * (np.arange(60_000) - 1000)))
    _, expected = signal.freqs(*analog, 2.0 * pi * frequency)
    assert np.abs(kernel @ answer - expected).max() < 0.002
    assert np.abs(weighting.response(frequency) - expected).max() < 1e-9


def test_doses_of_a_sine_are_closed_forms():
    time = DT * np.arange(20_000)
    force = REST + np.outer(0.5 * np.sin(2.0 * pi * time), [0.0, 1.0, 0.0])
    assert vibration_total(force, DT) == pytest.approx(0.5 * 1.011 / sqrt(2.0), rel=0.01)
    slow = REST + np.outer(0.5 * np.sin(2.0 * pi * 0.2 * time), [1.0, 0.0, 1.0])
    # Two axes with an rms of 0.5 |Wf| / sqrt(2) each, for 200 s.
    assert motion_sickness_dose(slow, DT) == pytest.approx(0.5 * 0.992 * sqrt(200.0), rel=0.02)


def test_rest_and_a_constant_force_have_no_dose():
    tilted = np.tile([1.0, 0.0, -9.7], (500, 1))
    assert vibration_total(tilted, DT) == motion_sickness_dose(tilted, DT) == 0.0


def test_a_perfect_machine_has_the_cars_doses_and_a_still_one_none():
    perfect, still = measure(drive(gain=1.0, lag=0.0)), measure(drive(gain=0.0))
    assert perfect.ride_comfort_ratio == pytest.approx(1.0)
    assert perfect.motion_dose_ratio == pytest.approx(1.0)
    assert still.ride_comfort_ratio == still.motion_dose_ratio == 0.0
    half = measure(drive(gain=0.5, lag=0.0))
    assert half.ride_comfort == pytest.approx(0.5 * perfect.ride_comfort)
    assert half.motion_dose_ratio == pytest.approx(0.5)


def test_the_ratio_to_a_car_at_rest_is_undefined():
    found = measure(trajectory())
    assert found.ride_comfort_ratio is None
    assert found.motion_dose_ratio is None
    assert found.jerk_ratio is None
    assert found.ride_comfort == found.motion_dose == 0.0
