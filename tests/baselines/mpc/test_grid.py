"""Accelerations between nodes, against small steps of the machine."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motion_cueing.baselines.mpc.prediction import make_grid

NODES = (0.01, 0.04, 0.1, 0.3, 0.35, 1.0)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_positions_and_rates_are_those_of_many_small_steps(seed):
    rng = np.random.default_rng(seed)
    grid = make_grid(NODES)
    a, q, v = rng.normal(size=(len(NODES), 2)), rng.normal(size=2), rng.normal(size=2)
    positions, rates = grid.motion(q, v, a)
    h = 1e-3
    middles = h * (np.arange(round(NODES[-1] / h)) + 0.5)
    mean = grid.at(a, middles)
    rate_after = v + h * np.cumsum(mean, axis=0)
    rate_before = rate_after - h * mean
    # A ramp's mean acceleration gives the rate exactly; the position to h^3 of its slope.
    position = q + np.cumsum(h * 0.5 * (rate_before + rate_after), axis=0)
    at = np.round(np.array(NODES) / h).astype(int) - 1
    assert np.abs(rate_after[at] - rates).max() < 1e-12
    assert np.abs(position[at] - positions).max() < 1e-5


def test_weights_are_a_mean():
    grid = make_grid(NODES)
    assert grid.weights.sum() == pytest.approx(1.0)
    assert np.all(grid.weights > 0.0)


def test_averages_keep_levels_and_see_what_lies_between_nodes():
    averages = make_grid(NODES).averages(0.01)
    assert averages.shape == (len(NODES), 100)
    assert np.allclose(averages.sum(axis=1), 1.0)
    assert averages[0, 0] == 1.0
    assert np.all(averages.sum(axis=0)[1:] > 0.0)


def test_a_plan_is_constant_outside_its_nodes():
    grid = make_grid(NODES)
    a = np.arange(6.0)[:, None]
    assert grid.at(a, np.array([0.0, 0.005, 5.0]))[:, 0].tolist() == [0.0, 0.0, 5.0]
    assert grid.at(a, np.array([0.2]))[0, 0] == pytest.approx(2.5)
