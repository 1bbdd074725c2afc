"""The watchdog's every step, against a table of its own."""

from __future__ import annotations

from itertools import product

import pytest

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.realtime.watchdog import Situation, State, WatchdogOptions, next_state

OPTIONS = WatchdogOptions(overdue=0.03, hold=0.2, steady=0.1)
AGES = (0.0, 0.03, 0.031, 0.2, 0.201, float("inf"))
STEADY = (0.0, 0.1)
FLAGS = (False, True)
N, R, H, B = State.NEUTRAL, State.RUNNING, State.HOLDING, State.BRAKING


def expected(state, age, steady, neutral, failed, stopping):
    """The same as sentences: the first that fits holds."""
    moved_by_policy = state in (R, H)
    sentences = [
        (moved_by_policy and (failed or stopping), B),
        (moved_by_policy and age > 0.2, B),
        (moved_by_policy and age > 0.03, H),
        (moved_by_policy, R),
        (not neutral, B),
        (failed or stopping, N),
        (age <= 0.03 and steady >= 0.1, R),
        (True, N),
    ]
    return next(then for holds, then in sentences if holds)


@pytest.mark.parametrize("state", State)
def test_every_state_in_every_situation(state):
    for situation in product(AGES, STEADY, FLAGS, FLAGS, FLAGS):
        assert next_state(state, Situation(*situation), OPTIONS) is expected(state, *situation), situation


def test_the_policy_moves_the_machine_only_from_neutral():
    for state, *situation in product((N, B), AGES, STEADY, [False], FLAGS, FLAGS):
        assert next_state(state, Situation(*situation), OPTIONS) is B


def test_nobody_holds_longer_than_cues_are_overdue():
    with pytest.raises(ConfigurationError, match="hold must not be less than overdue"):
        WatchdogOptions(overdue=0.3, hold=0.2)
