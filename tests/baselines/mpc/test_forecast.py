"""The cues ahead: known, or guessed."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.baselines.mpc import Forecast
from motion_cueing.baselines.mpc.prediction import REST, Forecaster, make_grid
from motion_cueing.envs.cues import CueTrace

NODES = (0.01, 0.1, 0.4, 1.0)
GRID = make_grid(NODES)


def drive(n: int = 400) -> CueTrace:
    rng = np.random.default_rng(0)
    force = rng.normal(size=(n, 3)) + REST[:3]
    return CueTrace("noise", 0.01 * np.arange(n), force, 0.1 * rng.normal(size=(n, 3)))


def values_of(cues: CueTrace) -> np.ndarray:
    return np.hstack([cues.specific_force, cues.angular_velocity])


def test_what_is_known_is_the_drive_itself():
    cues = drive()
    ahead = Forecaster(GRID, Forecast(preview=1.0), cues)(REST, REST, 37)
    expected = GRID.averages(0.01) @ values_of(cues)[38:138]
    assert np.abs(ahead - expected).max() < 1e-12


def test_a_longer_preview_than_the_horizon_is_the_horizon():
    cues = drive()
    assert np.array_equal(
        Forecaster(GRID, Forecast(preview=1.0), cues)(REST, REST, 5),
        Forecaster(GRID, Forecast(preview=9.0), cues)(REST, REST, 5),
    )


def test_after_the_end_the_last_cues_stay():
    cues = drive()
    ahead = Forecaster(GRID, Forecast(preview=1.0), cues)(REST, REST, 399)
    assert np.abs(ahead - values_of(cues)[-1]).max() < 1e-12


def test_a_guess_goes_to_rest_in_two_parts():
    forecast = Forecast(memory=1.0, force_decay=(0.5, 1.0, 2.0), rate_decay=0.2, lasting_decay=5.0)
    now, sustained = REST + 2.0, REST + 0.5
    ahead = Forecaster(GRID, forecast)(now, sustained, 0)
    times = 0.01 * np.arange(1, 101)[:, None]
    constants = np.array([0.5, 1.0, 2.0, 0.2, 0.2, 0.2])
    series = REST + 0.5 * np.exp(-times / 5.0) + 1.5 * np.exp(-times / constants)
    assert np.abs(ahead - GRID.averages(0.01) @ series).max() < 1e-12


def test_the_sustained_cue_is_a_low_pass_that_begins_at_the_first_cue():
    cues, forecast = drive(), Forecast(preview=0.3, memory=0.7)
    told, alone = Forecaster(GRID, forecast, cues), Forecaster(GRID, Forecast(memory=0.7))
    sustained = None
    values = values_of(cues)
    for now in values[:131]:
        sustained = alone.update(sustained, now)
    known = GRID.averages(0.01)[:, :30] @ values[101:131]
    guessed = told(REST, REST, 100) - known
    assert sustained is not None
    assert guessed[-1] == pytest.approx(_at_last_node(forecast, values[130], sustained), abs=1e-9)


def _at_last_node(forecast: Forecast, now: np.ndarray, sustained: np.ndarray) -> np.ndarray:
    weights = GRID.averages(0.01)[-1, 30:]
    after = 0.01 * np.arange(1, 71)[:, None]
    constants = np.array([*forecast.force_decay, *[forecast.rate_decay] * 3])
    series = (
        REST
        + (sustained - REST) * np.exp(-after / forecast.lasting_decay)
        + (now - sustained) * np.exp(-after / constants)
    )
    return np.asarray(weights @ series)
