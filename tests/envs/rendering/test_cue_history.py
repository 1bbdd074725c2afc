"""The history against plain lists, and J against the metric."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.rendering import CueHistory
from motion_cueing.evaluation.metrics import cue_error

from .moments import DT, weaving


@given(st.integers(0, 400), st.floats(0.05, 1.5))
def test_the_last_seconds_are_kept_in_order(samples, window):
    history = CueHistory("m", "p", DT, window=window)
    rng = np.random.default_rng(samples)
    rows = rng.normal(size=(samples, 12))
    for k, row in enumerate(rows):
        history.append(k * DT, row[:6], row[6:])
    kept = len(history)
    assert kept == min(samples, int(np.ceil(window / DT)) + 1)
    np.testing.assert_array_equal(history.reference_cue, rows[samples - kept :, :6])
    np.testing.assert_array_equal(history.simulator_cue, rows[samples - kept :, 6:])
    np.testing.assert_allclose(history.times, DT * np.arange(samples - kept, samples))
    assert history.time == (samples - 1) * DT if samples else history.time == 0.0


def test_j_is_the_metric_over_the_whole_drive():
    history, rng = CueHistory("m", "p", DT, window=0.5), np.random.default_rng(1)
    wanted, felt = rng.normal(size=(2, 300, 6))
    for k in range(300):
        history.append(k * DT, wanted[k], felt[k])
    assert history.cue_error == pytest.approx(float(cue_error(wanted, felt).mean()), rel=1e-12)
    np.testing.assert_allclose(history.peak, np.abs([wanted, felt]).max(axis=(0, 1)))


def test_clear_begins_anew():
    history = weaving(1000)
    history.clear()
    assert (len(history), history.time, history.cue_error) == (0, 0.0, 0.0)
    assert not history.peak.any()
    history.append(0.0, np.zeros(6), np.zeros(6))
    assert len(history.reference_cue) == 1


def test_what_is_no_sample_is_refused():
    history = weaving(3)
    with pytest.raises(DataError, match="increase"):
        history.append(2 * DT, np.zeros(6), np.zeros(6))
    with pytest.raises(DataError, match="6 finite"):
        history.append(1.0, np.zeros(5), np.zeros(6))
    with pytest.raises(DataError, match="6 finite"):
        history.append(1.0, np.full(6, np.nan), np.zeros(6))
    with pytest.raises(ConfigurationError, match="dt"):
        CueHistory("m", "p", 0.0)
    with pytest.raises(ValueError, match="read-only"):
        history.reference_cue[0] = 1.0
