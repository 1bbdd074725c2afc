"""The suite runs everything, and goes on after a failure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import ActionError, DataError
from motion_cueing.evaluation.metrics import measure
from motion_cueing.evaluation.suite import SETUP, explain, labels, run_suite

from .synthetic import drive


def cues() -> CueTrace:
    return CueTrace("weave", 0.01 * np.arange(5), np.zeros((5, 3)), np.zeros((5, 3)))


def raises(error: Exception):
    def work(*_):
        raise error

    return work


def test_every_policy_drives_every_maneuver_under_its_label():
    seen, steps = [], []
    outcome = run_suite(
        {"first": cues, "second": cues},
        {"a": lambda _: drive(), "b": lambda _: drive(gain=0.0)},
        lambda maneuver, drives: seen.append(
            (maneuver, {n: (d.maneuver, d.policy) for n, d in drives.items()})
        ),
        lambda maneuver, policy: steps.append((maneuver, policy)),
    )
    assert outcome.maneuvers == {
        name: {"a": measure(drive()), "b": measure(drive(gain=0.0))} for name in ("first", "second")
    }
    assert seen[1] == ("second", {"a": ("second", "a"), "b": ("second", "b")})
    assert steps == [(m, p) for m in ("first", "second") for p in (SETUP, "a", "b")]
    assert outcome.failures == []


def test_a_failed_drive_or_maneuver_leaves_the_others():
    finished = []
    outcome = run_suite(
        {"broken": raises(DataError("no road")), "good": cues},
        {"bad": raises(ZeroDivisionError("division by zero")), "fine": lambda _: drive()},
        lambda maneuver, drives: finished.append((maneuver, list(drives))),
    )
    assert [(f.maneuver, f.policy, f.message) for f in outcome.failures] == [
        ("broken", None, "no road"),
        ("good", "bad", "ZeroDivisionError: division by zero"),
    ]
    assert list(outcome.maneuvers) == ["good"]
    assert finished == [("good", ["fine"])]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_drive_without_metrics_leaves_the_others():
    """A cue beyond all bounds makes a J that is no number; the other policies and maneuvers are reported."""

    def far(trace):
        return replace(drive(), f_simulator=np.full((len(drive().time), 3), 1e200))

    outcome = run_suite({"a": cues}, {"far": far, "good": lambda _: drive()}, finish=lambda *_: None)
    assert list(outcome.maneuvers["a"]) == ["good"]
    assert [(f.maneuver, f.policy) for f in outcome.failures] == [("a", "far")]


def test_a_figure_that_fails_costs_no_result():
    outcome = run_suite({"a": cues}, {"good": lambda _: drive()}, finish=raises(OSError("disk full")))
    assert list(outcome.maneuvers["a"]) == ["good"]
    assert "disk full" in outcome.failures[0].message


def test_where_every_policy_fails_nothing_is_finished():
    outcome = run_suite(
        {"m": cues}, {"bad": raises(ActionError("nine numbers"))}, raises(AssertionError("called"))
    )
    assert outcome.maneuvers == {"m": {}}
    assert len(outcome.failures) == 1


def test_an_interrupt_is_not_swallowed():
    def interrupt(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_suite({"m": cues}, {"p": interrupt}, lambda *_: None)


def test_explanations_are_one_line():
    assert explain(DataError("a\n  b")) == "a b"
    assert explain(IndexError("x")) == "IndexError: x"
    assert explain(IndexError()) == "IndexError"


def test_labels_are_unique_and_repeated_names_count_once():
    assert labels(["x/a.csv", "y/a.csv", "b", "b"], ["a", "a", "b", "b"]) == {
        "x/a.csv": "a",
        "y/a.csv": "a-2",
        "b": "b",
    }
