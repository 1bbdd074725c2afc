"""Resampling: what is straight comes out straight, tones keep their height, and no beat is left."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.realtime.resampling import Resampler, SteadyClock

FRAME = 1.0 / 60.0


def filled(times, values, smoothing=2):
    resampler = Resampler(smoothing)
    for time, value in zip(times, values, strict=True):
        resampler.add(time, np.atleast_1d(value))
    return resampler


@pytest.mark.parametrize("smoothing", [1, 2, 3])
@given(seed=st.integers(0, 10**6), missing=st.integers(0, 20))
def test_a_straight_line_comes_out_exactly(smoothing, seed, missing):
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.5, 1.5, 60)) * FRAME
    times = np.delete(times, rng.choice(np.arange(2, 58), missing, replace=False))
    a, b = rng.normal(size=2)
    resampler = filled(times, a + b * times, smoothing)
    inner = times[np.argmax(times > times[-1] - 0.4) : -1]
    for time in rng.uniform(inner[0], inner[-1], 10):
        assert resampler.at(time)[0] == pytest.approx(a + b * time, abs=1e-7)


def test_a_time_after_all_frames_goes_on_with_their_trend_for_a_while():
    resampler = filled(np.arange(5) * FRAME, 2.0 * np.arange(5))
    newest, delay = resampler.newest, resampler.delay
    assert resampler.at(newest + 0.5 * delay)[0] == pytest.approx(10.0)
    assert resampler.at(newest + 9.0)[0] == resampler.at(newest + delay)[0] == pytest.approx(12.0)
    assert filled([1.0], [7.0]).at(9.0)[0] == 7.0
    assert filled([1.0, 1.1], [7.0, 7.0]).at(-9.0)[0] == pytest.approx(7.0)


def line(values, hz, rate=100.0):
    """Amplitude of a tone in values at ``rate``."""
    t = np.arange(len(values)) / rate
    window = np.hanning(len(values))
    return 2.0 * abs(np.sum(window * (values - values.mean()) * np.exp(-2j * np.pi * hz * t))) / window.sum()


def resampled(tone, smoothing, frames=900, rate=60.0):
    times = np.arange(frames) / rate
    out, resampler, taken = [], Resampler(smoothing), 0
    for k in range(100, int(frames / rate * 100) - 100):
        while taken < frames and times[taken] <= k / 100:
            resampler.add(times[taken], np.array([np.sin(2 * np.pi * tone * times[taken])]))
            taken += 1
        out.append(resampler.at(k / 100 - resampler.delay)[0])
    return np.array(out)


@pytest.mark.parametrize("smoothing", [1, 2, 3])
def test_a_tone_has_the_height_of_the_spline_and_its_images_as_well(smoothing):
    tone = 4.0
    out = resampled(tone, smoothing)
    sinc = np.sinc
    assert line(out, tone) == pytest.approx(sinc(tone / 60.0) ** (2 * smoothing), abs=3e-3)
    # Images at 60 -+ 4 Hz fold to 44 and 36 Hz of the 100 Hz.
    for image, folded in ((56.0, 44.0), (64.0, 36.0)):
        height = sinc(image / 60.0) ** (2 * smoothing)
        assert line(out, folded) == pytest.approx(height, abs=2e-3)


def test_no_beat_is_left_of_a_held_frame():
    """Held frames have a line at 20 -+ tone Hz, where policies at 100 Hz see the pattern come back."""
    tone, times = 2.0, np.arange(900) / 60.0
    held = np.sin(2 * np.pi * tone * times)[np.floor(np.arange(0.0, 14.0, 0.01) * 60.0 + 1e-9).astype(int)]
    smooth = resampled(tone, 2)
    beats = [hz for k in (20.0, 40.0) for hz in (k - tone, k + tone)]
    assert max(line(held, hz) for hz in beats) > 0.02
    assert max(line(smooth, hz) for hz in beats) < 2e-5


@given(seed=st.integers(0, 10**6), rate=st.sampled_from([50.0, 60.0, 72.0, 100.0]))
def test_stamps_in_milliseconds_become_even(seed, rate):
    start = np.random.default_rng(seed).uniform(0.0, 1.0)
    true = start + np.arange(600) / rate
    clock = SteadyClock(0.001)
    found = np.array([clock(float(np.floor(1000.0 * t) / 1000.0)) for t in true])
    late = (found - true)[200:]
    # Rounding down makes them early by half a millisecond on average; only the variation is felt.
    assert np.std(late) < 1e-4
    assert np.all(np.diff(found) > 0.0)


@given(steps=st.lists(st.floats(1e-3, 0.5), min_size=2, max_size=60), tick=st.sampled_from([0.0, 0.001]))
def test_uneven_stamps_are_believed_and_never_run_backwards(steps, tick):
    clock, stamps = SteadyClock(tick), np.cumsum(steps)
    found = np.array([clock(float(stamp)) for stamp in stamps])
    assert np.all(np.diff(found) > 0.0)
    assert np.abs(found - stamps).max() <= 1.5 * tick


def test_frames_that_come_faster_than_the_policy_acts_are_averaged():
    times = np.arange(2000) / 1000.0
    noise = np.random.default_rng(3).normal(size=2000)
    resampler = filled(times, noise)
    values = np.array([resampler.at(t)[0] for t in np.arange(1.93, 1.97, 0.001)])
    assert np.std(values) < 0.5
