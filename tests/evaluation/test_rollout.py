"""What rollout refuses, and what it passes on."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.baselines import ClassicalWashout, NoMotion
from motion_cueing.envs.errors import ActionError, ConfigurationError, DataError
from motion_cueing.evaluation import rollout

from ..baselines.drives import trace


class Returning:
    """A policy with a fixed answer."""

    def __init__(self, answer) -> None:
        self.answer = answer

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return self.answer


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (np.zeros(9), "must return"),
        ((np.zeros(8), None), "shape"),
        ((np.full(9, np.nan), None), "finite"),
        (("x", None), "not made of numbers"),
    ],
)
def test_a_policy_that_breaks_the_protocol_is_refused(answer, told):
    with pytest.raises(ActionError, match=told):
        rollout(Returning(answer), trace(0.1))


def test_wrong_arguments_are_refused():
    with pytest.raises(ConfigurationError, match="CueTrace"):
        rollout(NoMotion(), "lane-change")
    with pytest.raises(ConfigurationError, match="Platform"):
        rollout(NoMotion(), trace(0.1), platform="paper")
    with pytest.raises(ConfigurationError, match="time step"):
        rollout(ClassicalWashout(), trace(0.1), dt=0.002)
    with pytest.raises(DataError, match="outside the travel of paper"):
        rollout(NoMotion(), trace(0.1), start=[50.0, 0, 0, 0, 0, 0, 0, 0, 0])
    with pytest.raises(DataError, match="cannot be reached"):
        rollout(NoMotion(), trace(0.1), start=[0.0, 0, 0, 0, 5.0, 0, 0, 0, 0])


def test_progress_counts_every_step():
    seen = []
    rollout(NoMotion(), trace(0.05), on_step=lambda done, of: seen.append((done, of)))
    assert seen == [(k, 5) for k in range(1, 6)]
