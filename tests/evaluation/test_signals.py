"""Resemblance of signals against scipy, numpy and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from motion_cueing.evaluation import signals

VALUES = st.floats(-10.0, 10.0, allow_subnormal=False)
SIGNAL = arrays(np.float64, 60, elements=VALUES)


def noise(n: int = 400, seed: int = 0) -> np.ndarray:
    """A smooth random signal."""
    raw = np.random.default_rng(seed).normal(size=n + 20)
    return np.convolve(raw, np.hanning(21), mode="valid")


@given(SIGNAL, SIGNAL)
def test_pearson_is_scipys(a, b):
    assume(a.std() > 1e-2)
    assume(b.std() > 1e-2)
    assert signals.pearson(a, b) == pytest.approx(stats.pearsonr(a, b).statistic, abs=1e-9)


@pytest.mark.parametrize("flat", ["first", "second"])
def test_pearson_of_a_constant_is_undefined(flat):
    wave, constant = np.sin(np.arange(50.0)), np.full(50, 3.0) + 1e-9 * np.arange(50)
    pair = (constant, wave) if flat == "first" else (wave, constant)
    assert signals.pearson(*pair) is None


def test_correlation_by_lag_is_numpys_on_the_overlap():
    a, b = noise(seed=1), noise(seed=2) + 3.0
    n, reach = len(a), 30
    found = signals.correlation_by_lag(a, b, reach)
    for lag in range(-reach, reach + 1):
        left = a[max(0, -lag) : n - max(0, lag)]
        right = b[max(0, lag) : n - max(0, -lag)]
        assert found[lag + reach] == pytest.approx(np.corrcoef(left, right)[0, 1], abs=1e-10)


@pytest.mark.parametrize("lag", [-17, -1, 0, 1, 8, 29])
def test_delay_finds_a_shift_of_whole_samples(lag):
    long, dt = noise(500), 0.02
    wanted, felt = long[50:450], 0.4 * long[50 - lag : 450 - lag] + 2.0
    assert signals.delay(wanted, felt, dt, 1.0, 0.5) == pytest.approx(lag * dt, abs=0.1 * dt)


def test_delay_of_a_sine_is_its_phase_between_samples():
    dt, frequency, late = 0.05, 0.35, 0.123
    time = dt * np.arange(2000)
    wanted = np.sin(2 * np.pi * frequency * time)
    felt = np.sin(2 * np.pi * frequency * (time - late))
    assert signals.delay(wanted, felt, dt, 1.0, 0.5) == pytest.approx(late, abs=2e-3)


def test_delay_is_undefined_without_a_peak_inside_the_search():
    time = 0.02 * np.arange(1000)
    wave = np.sin(2 * np.pi * 0.1 * time)
    assert signals.delay(wave, np.sin(2 * np.pi * 0.1 * (time - 2.0)), 0.02, 1.0, 0.5) is None
    assert signals.delay(noise(seed=3), noise(seed=4), 0.02, 0.5, 0.9) is None
    assert signals.delay(wave, np.zeros(1000), 0.02, 1.0, 0.5) is None
    assert signals.delay(wave[:3], wave[:3], 0.02, 1.0, 0.5) is None


@given(SIGNAL, st.floats(0.01, 1.0))
def test_no_motion_has_a_normalized_error_of_one_or_less(wanted, floor):
    error = signals.normalized_rmse(wanted, np.zeros_like(wanted), floor)
    strong = signals.rms(wanted) >= floor
    assert error == pytest.approx(1.0) if strong else error < 1.0


def test_normalized_rmse_uses_the_floor_where_the_car_is_still():
    assert signals.normalized_rmse(np.zeros(4), np.full(4, 0.5), 0.25) == pytest.approx(2.0)


def test_false_and_missing_cues_by_hand():
    wanted = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 0.16, -1.0, 0.18])
    felt = np.array([0.1, 0.5, -0.5, 0.5, 0.1, 0.18, 0.05, 0.16])
    #                 quiet false  false  shape miss  near  miss  near
    assert signals.false_cues(wanted, felt, 0.17).tolist() == [False, True, True] + [False] * 5
    assert signals.missing_cues(wanted, felt, 0.17).tolist() == [False] * 4 + [True, False, True, False]


@given(SIGNAL, SIGNAL, st.floats(0.01, 2.0))
def test_a_cue_is_never_false_and_missing_at_once(wanted, felt, threshold):
    both = signals.false_cues(wanted, felt, threshold) & signals.missing_cues(wanted, felt, threshold)
    assert not both.any()
    assert not signals.false_cues(wanted, wanted, threshold).any()
    assert not signals.missing_cues(wanted, wanted, threshold).any()


@given(SIGNAL, SIGNAL)
def test_beyond_is_the_distance_to_the_interval_from_zero_to_wanted(wanted, felt):
    for w, f, extra in zip(wanted, felt, signals.beyond(wanted, felt), strict=True):
        low, high = min(0.0, w), max(0.0, w)
        assert extra == pytest.approx(f - high if f > high else f - low if f < low else 0.0)


TIME = np.arange(0.0, 6.0, 0.01)


def shaking(amplitude: float, frequency: float, *, until: float = 6.0) -> np.ndarray:
    """(n, 2) of which the second shakes for a while."""
    wave = amplitude * np.sin(2.0 * np.pi * frequency * TIME) * (until > TIME)
    return np.column_stack([np.zeros_like(TIME), wave])


@pytest.mark.parametrize("frequency", [8.0, 15.0, 25.0])
def test_vibration_is_the_rms_of_what_shakes(frequency):
    found = signals.vibration(shaking(0.0, 1.0), shaking(0.3, frequency), 0.01, 4.0, 1.0)
    assert found == pytest.approx(0.3 / np.sqrt(2.0), rel=0.03)


def test_vibration_is_that_of_the_worst_second():
    found = signals.vibration(shaking(0.0, 1.0), shaking(0.3, 10.0, until=0.5), 0.01, 4.0, 1.0)
    assert found == pytest.approx(0.3 / np.sqrt(2.0) * np.sqrt(0.5), rel=0.05)


def test_slow_motion_and_rest_are_no_vibration():
    rest = shaking(0.0, 1.0)
    assert signals.vibration(rest, rest - 9.81, 0.01, 4.0, 1.0) == pytest.approx(0.0, abs=1e-9)
    assert signals.vibration(rest, shaking(5.0, 0.5), 0.01, 4.0, 1.0) < 0.02


def test_the_cars_own_vibration_is_not_the_simulators():
    car, late = shaking(0.3, 10.0), np.roll(shaking(0.3, 10.0), 3, axis=0)
    assert signals.vibration(car, late, 0.01, 4.0, 1.0) < 0.06  # from the ends alone
    assert signals.vibration(car, shaking(0.0, 1.0), 0.01, 4.0, 1.0) == 0.0
    both = signals.vibration(car, np.sqrt(2.0) * late, 0.01, 4.0, 1.0)
    assert both == pytest.approx(0.3 / np.sqrt(2.0), rel=0.05)


@pytest.mark.parametrize(("samples", "dt"), [(100, 0.01), (600, 0.125), (1, 0.01)])
def test_vibration_of_what_is_too_short_or_coarse_is_undefined(samples, dt):
    quiet = np.zeros((samples, 3))
    assert signals.vibration(quiet, quiet, dt, 4.0, 1.0) is None
