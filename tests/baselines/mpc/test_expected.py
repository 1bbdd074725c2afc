"""Predictive control with expected cues in place of the true preview."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from motion_cueing.baselines.mpc.parameters import Forecast
from motion_cueing.baselines.mpc.prediction import Forecaster
from motion_cueing.envs.expected import ExpectedCues, held

from .test_forecast import GRID, drive


def test_true_cues_as_expected_ones_give_the_forecast_of_the_preview():
    cues, forecast = drive(), Forecast(preview=0.3, memory=0.7)
    rows = np.hstack((cues.specific_force, cues.angular_velocity))
    leads = 0.01 * np.arange(1, 31)
    ahead = np.arange(len(rows))[:, None] + np.arange(1, 31)
    truth = ExpectedCues(leads, rows[np.minimum(ahead, len(rows) - 1)])
    true, same = Forecaster(GRID, forecast, cues), Forecaster(GRID, forecast, replace(cues, expected=truth))
    sustained = None
    for k in range(40):
        sustained = true.update(sustained, rows[k])
        np.testing.assert_allclose(
            same(rows[k], sustained, k), true(rows[k], sustained, k), rtol=1e-6, atol=1e-6
        )


def test_held_cues_are_a_constant_preview():
    cues, forecast = drive(), Forecast(preview=0.3, memory=0.7)
    rows = np.hstack((cues.specific_force, cues.angular_velocity))
    known = Forecaster(GRID, forecast, replace(cues, expected=held(rows)))
    true = Forecaster(GRID, forecast, cues)
    now = rows[20]
    assert not np.allclose(known(now, now, 20), true(now, now, 20))
    within = GRID.times < 0.25
    np.testing.assert_allclose(known(now, now, 20)[within][0], now, atol=1e-6)
