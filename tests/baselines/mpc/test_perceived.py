"""The perceived error over the horizon, against the transfer functions."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lsim

from motion_cueing.baselines.mpc.prediction import PerceivedError, cue_scales, make_grid
from motion_cueing.envs.perception import get_vestibular_model

from .machines import quick

NODES = (0.01, 0.05, 0.15, 0.4, 1.0)


@pytest.mark.parametrize("name", ["zacharias", "telban"])
@pytest.mark.parametrize("cue", [0, 2, 3, 5])
def test_the_response_is_that_of_the_transfer_function(name, cue):
    grid, model = make_grid(NODES), get_vestibular_model(name)
    perception = PerceivedError(grid, quick(nodes=NODES, objective="perceived", vestibular=name))
    rng = np.random.default_rng(cue)
    past, ahead = rng.normal(size=51), rng.normal(size=len(NODES))
    state = perception.start()
    unit = cue_scales()[cue] * np.eye(6)[cue]
    # A past that begins at rest, sampled at 100 Hz, then straight lines from node to node.
    past[0] = 0.0
    for before, now in pairwise(past):
        state = perception.advance(state, before * unit, now * unit)
    assert perception.response is not None
    predicted = perception.response[cue] @ ahead + perception.free_response(state, past[-1] * unit)[:, cue]
    h = 0.01
    times = h * np.arange(51 + 100)
    knots = np.concatenate([h * np.arange(51), 0.5 + np.array(NODES)])
    signal = np.interp(times, knots, np.concatenate([past, ahead]))
    system = model.otoliths.transfer_function() if cue < 3 else model.canals.transfer_function(cue - 3)
    out = lsim(system, signal, times, interp=True)[1]
    at = 50 + np.round(np.array(NODES) / h).astype(int)
    assert np.abs(predicted - out[at]).max() < 1e-9 * max(1.0, np.abs(out).max())


def test_the_cab_objective_filters_nothing():
    perception = PerceivedError(make_grid(NODES), quick(nodes=NODES))
    assert perception.response is None
    assert perception.free_response(np.zeros((6, 3)), np.ones(6)) is None
