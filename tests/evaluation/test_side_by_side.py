"""Drives side by side: what each comes to is what it comes to alone, to the last digit."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from motion_cueing.baselines import Information, NoMotion
from motion_cueing.baselines.policy import NOW, WHOLE_DRIVE, as_policy
from motion_cueing.envs.errors import PolicyError
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation import rollout
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.evaluation.rollout import batches, rollouts

from ..baselines.drives import trace, weave

PAPER = get_platform("paper")
DRIVES = [trace(0.4, weave), trace(0.7, lambda t: 2.0 * weave(t)), trace(0.3)]
"""Of different length."""

SIGNALS = ("f_simulator", "w_simulator", "perceived_f_simulator", "legs", "action", "limits_active")


@pytest.mark.parametrize("name", ["classical-tuned", "learned", "learned-preview", "mpc", "mpc-preview"])
def test_a_drive_side_by_side_equals_the_drive_alone(name):
    policy = make_policy(name, PAPER)
    for drive, found in zip(DRIVES, rollouts(policy, DRIVES, PAPER), strict=True):
        alone = rollout(policy, drive, PAPER)
        for signal in SIGNALS:
            np.testing.assert_array_equal(getattr(found, signal), getattr(alone, signal), err_msg=signal)
        assert found.metadata == alone.metadata
        assert (np.isfinite(found.step_time) == np.isfinite(alone.step_time)).all()


def test_a_policy_is_not_called_after_the_end_of_a_drive():
    calls = []

    class Counting(NoMotion):
        def predict(self, observation, state=None, episode_start=None, deterministic=True):
            calls.append(len(observation))
            return super().predict(observation, state)

    assert [len(found) for found in rollouts(Counting(), DRIVES, PAPER)] == [len(one) for one in DRIVES]
    assert calls == [1] * sum(len(one) - 1 for one in DRIVES)


def test_an_error_names_the_policy():
    class Broken(NoMotion):
        name = "broken"

        def predict(self, observation, state=None, episode_start=None, deterministic=True):
            raise ZeroDivisionError("no")

    with pytest.raises(PolicyError, match="broken raised"):
        list(rollouts(Broken(), DRIVES, PAPER))


def test_batches_hold_every_drive_once_those_of_similar_length_together():
    drives = {f"{k}": trace(0.1 + 0.01 * k) for k in range(40)}
    groups = batches(NoMotion(), drives)
    assert sorted(name for group in groups for name in group) == sorted(drives)
    assert len(groups) == 3
    spans = [[drives[name].duration for name in group] for group in groups]
    assert all(min(longer) >= max(shorter) for longer, shorter in pairwise(spans))


def test_a_policy_that_knows_its_drive_or_promised_nothing_drives_alone():
    class Mine:
        def predict(self, observation, state=None, episode_start=None, deterministic=True):
            return np.zeros((len(observation), 9)), state

    drives = {"a": DRIVES[0], "b": DRIVES[1]}
    assert [len(group) for group in batches(make_policy("mpc-preview", PAPER), drives)] == [1, 1]
    assert [len(group) for group in batches(as_policy(Mine()), drives)] == [1, 1]
    Mine.side_by_side = True
    assert [len(group) for group in batches(as_policy(Mine()), drives)] == [2]


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("classical", "now"),
        ("mpc", "now"),
        ("learned", "now"),
        ("mpc-preview", "2 s true"),
        ("learned-preview", "2 s true"),
        ("optimum", "whole drive"),
        ("classical-per-maneuver", "whole drive"),
    ],
)
def test_every_policy_says_what_it_knows(name, label):
    assert make_policy(name, PAPER).information.label == label


def test_the_classes_of_information_have_names():
    assert (NOW.label, WHOLE_DRIVE.label) == ("now", "whole drive")
    assert Information("road").label == "road"
    assert Information("preview", 0.5).label == "0.5 s true"
