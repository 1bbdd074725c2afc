"""The normalized score, and the verdict: the better policy, the margin and the reason."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from motion_cueing.evaluation.comparison import (
    NormalizedScore,
    advantage,
    judge,
    judge_suite,
    normalized_score,
    normalized_scores,
    terms,
)
from motion_cueing.evaluation.metrics import References, measure

from .synthetic import GRAVITY, drive, trajectory

STILL = measure(drive(gain=0.0))
GOOD = measure(drive(gain=0.9, lag=0.0))
LATE = measure(drive(gain=0.9, lag=0.4))


def push(y: float):
    """A car pushed by 1 m/s^2 to the right, the simulator by ``y``."""
    reference, simulated = (np.tile([0.0, side, -GRAVITY], (201, 1)) for side in (1.0, y))
    return measure(trajectory(f_reference=reference, f_simulator=simulated))


def test_terms_add_up_to_the_cue_error():
    for metrics in (STILL, GOOD, LATE):
        assert sum(terms(metrics).values()) == pytest.approx(metrics.cue_error)


def test_the_lowest_cue_error_is_best_and_the_margin_is_relative():
    verdict = judge("weave", {"late": LATE, "no-motion": STILL, "good": GOOD})
    assert verdict.ranking == ("good", "late", "no-motion")
    assert verdict.cue_error == GOOD.cue_error
    assert [a.over for a in verdict.advantages] == ["late", "no-motion"]
    assert verdict.advantages[0].margin == pytest.approx(1.0 - GOOD.cue_error / LATE.cue_error)
    assert verdict.advantages[1].margin == pytest.approx(1.0 - GOOD.cue_error / STILL.cue_error)


@pytest.mark.parametrize(("worse", "cause"), [(0.0, "missing"), (-1.0, "false"), (0.4, "shape")])
def test_the_cause_is_what_the_other_does_wrong(worse, cause):
    why = judge("push", {"a": push(0.9), "b": push(worse)}).advantages[0]
    assert (why.axis, why.cause) == ("f_y", cause)
    assert why.axis_share == pytest.approx(1.0)
    assert why.worse_axis is None


def test_the_axis_on_which_the_best_is_worse_is_named():
    f = np.tile([0.0, 2.0, -GRAVITY], (201, 1))
    tilt = np.tile([0.07, 0.0, 0.0], (201, 1))
    tilting = measure(trajectory(f_reference=f, f_simulator=f, w_simulator=tilt))
    still = measure(trajectory(f_reference=f))
    why = judge("turn", {"no-motion": still, "tilting": tilting}).advantages[0]
    loss = (0.07 / np.radians(3.0)) ** 2
    gain = (2.0 / 0.6) ** 2
    assert (why.axis, why.cause, why.worse_axis, why.worse_cause) == ("f_y", "missing", "w_x", "false")
    assert why.axis_share == pytest.approx(gain / (gain - loss))
    assert judge("t", {"no-motion": still, "a": tilting}).sentences == [
        "a is best: J = 1.79.",
        "Its J is 84% lower than that of no-motion (11.1). It gains most on f_y (11.1): fewer missing cues. "
        "It is worse on w_x: false cues.",
    ]


def test_equal_policies_are_level():
    verdict = judge("weave", {"b": GOOD, "a": GOOD})
    assert verdict.ranking == ("a", "b")
    assert verdict.advantages[0].margin == 0.0
    assert verdict.advantages[0].axis is None
    assert verdict.sentences[1] == f"b has the same J ({GOOD.cue_error:.3g})."


def test_one_policy_alone_has_no_advantage():
    verdict = judge("weave", {"good": GOOD})
    assert verdict.advantages == ()
    assert len(verdict.sentences) == 1


def test_an_advantage_is_never_negative():
    assert advantage(terms(STILL), "good", terms(GOOD)).margin == 0.0


def test_the_perceived_best_is_named_where_it_differs():
    rest = np.tile([0.0, 0.0, -GRAVITY], (201, 1))
    numb = measure(trajectory(f_reference=rest, f_simulator=rest, perceived_f_simulator=rest + 1.0))
    off = measure(trajectory(f_simulator=rest + 0.1))
    verdict = judge("rest", {"numb": numb, "off": off})
    assert (verdict.best, verdict.perceived_best) == ("numb", "off")
    assert verdict.sentences[-1] == "By the perceived J, off is best."


def test_the_suite_averages_only_what_every_policy_finished():
    verdict, scores = judge_suite(
        {
            "weave": {"good": GOOD, "no-motion": STILL},
            "again": {"good": LATE, "no-motion": STILL},
            "broken": {"no-motion": GOOD},
        }
    )
    assert verdict is not None
    assert verdict.maneuver == "all"
    assert [s.policy for s in scores] == ["good", "no-motion"]
    assert scores[0].cue_error == pytest.approx((GOOD.cue_error + LATE.cue_error) / 2)
    assert verdict.cue_error == pytest.approx(scores[0].cue_error)
    assert (scores[0].wins, scores[0].maneuvers, scores[0].worst_maneuver) == (2, 2, "again")
    assert scores[1].wins == 0


def test_a_suite_without_a_common_maneuver_has_no_verdict():
    assert judge_suite({"a": {"x": GOOD}, "b": {"y": GOOD}}) == (None, [])
    assert judge_suite({}) == (None, [])


J = st.floats(0.0, 1e3)


@given(J, J, J)
@example(1e3, 1.1e-308, 0.0)
def test_the_score_is_0_at_the_baseline_and_1_at_the_optimum_and_linear_between(value, baseline, optimum):
    score = normalized_score(value, baseline, optimum)
    if score is None:
        assert baseline <= optimum or abs(baseline - value) > 1e300 * (baseline - optimum)
        return
    assert normalized_score(baseline, baseline, optimum) == 0.0
    assert normalized_score(optimum, baseline, optimum) == 1.0
    assert baseline - score * (baseline - optimum) == pytest.approx(value, abs=1e-9 * max(baseline, value))


@pytest.mark.parametrize(("baseline", "optimum"), [(None, 1.0), (2.0, None), (None, None), (1.0, 1.0)])
def test_without_a_gap_there_is_no_score(baseline, optimum):
    assert normalized_score(0.5, baseline, optimum) is None


def test_j_and_the_perceived_j_have_optima_of_their_own():
    found = normalized_scores(
        {"optimal-washout-tuned": 4.0, "mpc": 2.0, "optimum": 1.0, "optimum-perceived": 1.5},
        {"optimal-washout-tuned": 8.0, "mpc": 5.0, "optimum": 3.0, "optimum-perceived": 2.0},
        References(),
    )
    assert found["mpc"] == NormalizedScore(2.0 / 3.0, 0.5)
    assert found["optimum-perceived"].perceived_cue_error == 1.0
    assert found["optimum-perceived"].cue_error == pytest.approx(2.5 / 3.0)
