"""Networks with more inputs: the policy stays what it was."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.train.agents import Network


@pytest.mark.parametrize("skip", [False, True])
def test_a_widened_network_acts_alike_and_ignores_what_is_new(skip):
    rng = np.random.default_rng(2)
    last = 8 + 5 * skip
    network = Network(
        (rng.normal(size=(8, 5)), rng.normal(size=(3, last))),
        (rng.normal(size=8), rng.normal(size=3)),
        skip=skip,
        mean=rng.normal(size=5),
        variance=rng.uniform(0.5, 2.0, size=5),
    )
    places = np.array([6, 0, 3, 1, 4])
    wide = network.widened(places, 7)
    seen = rng.normal(size=(20, 7))
    before = network(seen[:, places])
    np.testing.assert_allclose(wide(seen), before, rtol=1e-5, atol=1e-6)
    seen[:, [2, 5]] += 100.0
    np.testing.assert_allclose(wide(seen), before, rtol=1e-5, atol=1e-6)
