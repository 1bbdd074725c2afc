"""Studies: what is driven, kept and driven again, and what comes of it."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from motion_cueing.baselines.washout import load_washout
from motion_cueing.baselines.washout.classical import policies as per_maneuver
from motion_cueing.baselines.washout.classical.policies import PerManeuverWashout, load_per_maneuver
from motion_cueing.cli.studies import results_of
from motion_cueing.envs.car import get_car
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.studies import study as study_module
from motion_cueing.evaluation.studies.figures import heat_figure, lines_figure
from motion_cueing.evaluation.studies.results import (
    StudyResults,
    condition_table,
    matrix_table,
    print_study,
    score_tables,
)
from motion_cueing.evaluation.studies.study import Condition, identity, run_study

from ..synthetic import drive
from .bends import PAPER, SEDAN, bend

GAINS = {"no-motion": 0.0, "optimal-washout-tuned": 0.6, "mine": 0.8, "optimum": 0.95}


class Gain:
    """A made-up policy, by its gain."""

    def __init__(self, gain, parameters=None):
        self.gain, self.parameters = gain, parameters


@pytest.fixture
def roll(monkeypatch):
    """A simulator that answers at once, and counts: the condition's machine takes part of the gain away."""
    driven = []

    def rolled(policy, cues, platform, car):
        driven.append((policy.gain, cues.name, platform.name))
        if cues.name == "cliff" and policy.gain == 0.8:
            raise RuntimeError("fell")
        made = drive(policy.gain * (1.0 if platform.turntable else 0.5))
        return replace(made, metadata={**made.metadata, "solves": "7"} if policy.gain == 0.95 else {})

    monkeypatch.setattr(study_module, "rollout", rolled)
    return driven


def condition(platform=PAPER, maneuvers=("bend", "ridge"), make=None, **more):
    sources = {name: (lambda name=name: bend(name)) for name in maneuvers}
    chosen = make or (lambda name: Gain(GAINS[name]))
    return Condition(platform.name, platform.description, platform, SEDAN, sources, chosen, **more)


CONDITIONS = [condition(), condition(get_platform("paper-no-turntable"))]
POLICIES = {name: name for name in GAINS}


def study_of(conditions, folder, policies=POLICIES):
    outcome = run_study(conditions, policies, folder)
    return results_of(conditions, list(policies), outcome, ["motion-cueing", "compare"]), outcome


def test_what_is_done_is_not_driven_again(roll, tmp_path):
    first, outcome = study_of(CONDITIONS, tmp_path)
    assert outcome.driven == len(roll) == 2 * 2 * 4
    again, outcome = study_of(CONDITIONS, tmp_path)
    assert outcome.driven == 0
    assert again.metrics == first.metrics
    assert (
        again.notes
        == first.notes
        == {name.name: {"optimum": {m: {"solves": "7"} for m in ("bend", "ridge")}} for name in CONDITIONS}
    )
    assert len(roll) == 16


def test_an_extended_study_drives_what_is_new(roll, tmp_path):
    study_of(CONDITIONS[:1], tmp_path, {"mine": "mine"})
    longer = [condition(maneuvers=("bend", "ridge", "hill")), CONDITIONS[1]]
    assert study_of(longer, tmp_path)[1].driven == 5 * 4 - 2


def test_an_interrupted_study_goes_on(roll, tmp_path, monkeypatch):
    rolled, calls = study_module.rollout, []

    def interrupted(*arguments):
        calls.append(1)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return rolled(*arguments)

    monkeypatch.setattr(study_module, "rollout", interrupted)
    with pytest.raises(KeyboardInterrupt):
        study_of(CONDITIONS, tmp_path)
    monkeypatch.setattr(study_module, "rollout", rolled)
    assert study_of(CONDITIONS, tmp_path)[1].driven == 16 - 3


def heavier(platform):
    return replace(platform, hexapod=replace(platform.hexapod, velocity=0.5))


@pytest.mark.parametrize(
    "other",
    [
        condition(heavier(PAPER)),
        replace(condition(), car=get_car("volvo-v40")),
        condition(about={"noise": 1}),
        condition(make=lambda name: Gain(GAINS[name], load_washout("classical"))),
        replace(condition(), maneuvers={"bend": lambda: bend(force=2.0)}),
    ],
)
def test_a_drive_that_differs_is_driven_again(other, roll, tmp_path):
    study_of([condition(maneuvers=("bend",))], tmp_path, {"mine": "mine"})
    one = replace(other, maneuvers={"bend": other.maneuvers["bend"]})
    assert study_of([one], tmp_path, {"mine": "mine"})[1].driven == 1


def test_a_file_that_changes_is_another_policy(roll, tmp_path):
    made = condition(maneuvers=("bend",), make=lambda name: Gain(0.5))
    file = tmp_path / "mine.yaml"
    for text, driven in (("a", 1), ("a", 0), ("b", 1)):
        file.write_text(text)
        assert study_of([made], tmp_path, {"mine": str(file)})[1].driven == driven


def test_a_broken_file_of_drives_is_told(roll, tmp_path):
    study_of(CONDITIONS, tmp_path)
    broken = next((tmp_path / "pairs").iterdir())
    broken.write_text("{")
    with pytest.raises(DataError, match="--fresh"):
        study_of(CONDITIONS, tmp_path)


def troubled():
    """A condition in which a policy cannot be made, one falls off the cliff, and a maneuver has no road."""

    def make(name):
        if name == "optimum":
            raise ConfigurationError("needs a solver")
        return Gain(GAINS[name])

    def fails():
        raise DataError("no road")

    one = condition(maneuvers=("bend", "cliff"), make=make)
    return replace(one, maneuvers={**one.maneuvers, "gap": fails})


def test_left_out_and_failed_are_told_and_the_others_stay(roll, tmp_path):
    one = troubled()
    results, _ = study_of([one], tmp_path)
    assert results.skipped == {"paper": {"optimum": "needs a solver"}}
    told = {(failure.policy, failure.maneuver): failure.message for failure in results.failures}
    assert told == {(None, "gap"): "no road", ("mine", "cliff"): "RuntimeError: fell"}
    # Means are over what every policy finished.
    assert results.maneuvers == ("bend",)
    assert set(results.summaries["paper"]) == {"no-motion", "optimal-washout-tuned", "mine"}
    assert results.driven == tuple(row[0] for row in matrix_table(results, "t", False).rows)
    assert set(results.driven) == {"no-motion", "optimal-washout-tuned", "mine"}
    assert results.skipped_lines() == ["optimum: needs a solver"]
    partly = replace(results, conditions={**results.conditions, "other": "another machine"})
    assert partly.skipped_lines() == ["optimum, paper: needs a solver"]


def test_every_drive_is_counted_done_failed_and_left_out(roll, tmp_path):
    one = troubled()
    told = []
    for _ in range(2):
        run_study([one], POLICIES, tmp_path, lambda what, who: told.append(who))
    assert told == 2 * [name for name in POLICIES for _ in one.maneuvers]


def test_a_drive_is_known_by_its_motion_not_its_name(roll, tmp_path):
    policies = {"mine": "mine"}
    study_of([condition(maneuvers=("bend",))], tmp_path, policies)
    for name, driven in (("another", 0), ("bend", 0)):
        other = replace(condition(), maneuvers={"bend": lambda name=name: bend(name)})
        assert study_of([other], tmp_path, policies)[1].driven == driven
    spun = replace(bend(), angular_acceleration=bend().angular_acceleration + 1e-9)
    assert (
        study_of([replace(condition(), maneuvers={"bend": lambda: spun})], tmp_path, policies)[1].driven == 1
    )


def test_an_oracle_of_other_sets_is_another_policy(monkeypatch):
    before = identity("classical-per-maneuver", PerManeuverWashout(PAPER))
    assert identity("classical-per-maneuver", PerManeuverWashout(PAPER)) == before
    edited = replace(load_per_maneuver("hill"), turntable_share=0.25)
    monkeypatch.setattr(per_maneuver, "load_per_maneuver", lambda name: edited)
    assert identity("classical-per-maneuver", PerManeuverWashout(PAPER)) != before


def test_summaries_are_means_with_ratio_and_share(roll, tmp_path):
    results, _ = study_of(CONDITIONS, tmp_path)
    whole, locked = results.summaries.values()
    metrics = results.metrics["paper"]["mine"]
    assert whole["mine"].cue_error == pytest.approx(np.mean([m.cue_error for m in metrics.values()]))
    assert (whole["optimal-washout-tuned"].normalized_score, whole["optimum"].normalized_score) == (0.0, 1.0)
    assert whole["mine"].perceived_normalized_score is None
    assert locked["mine"].ratio == pytest.approx(locked["mine"].cue_error / whole["mine"].cue_error)
    assert locked["no-motion"].ratio == 1.0
    table = condition_table(results, "paper")
    assert table.rows[0][0] == "optimum"
    assert table.rows[0][table.header.index("normalized score")] == "1.00"
    cell = matrix_table(results, "t", True).rows[2][2]
    assert cell.endswith(f"(×{locked['mine'].ratio:.2f})")


def test_results_are_written_read_and_drawn(roll, tmp_path):
    results, _ = study_of(CONDITIONS, tmp_path)
    results.save_json(tmp_path / "study.json")
    assert StudyResults.load_json(tmp_path / "study.json") == results
    results.save_csv(tmp_path / "study.csv")
    rows = list(csv.DictReader((tmp_path / "study.csv").open()))
    assert [(row["condition"], row["policy"]) for row in rows[:2]] == [
        ("paper", "no-motion"),
        ("paper", "optimal-washout-tuned"),
    ]
    assert float(rows[2]["cue_error"]) == results.summaries["paper"]["mine"].cue_error
    nothing = replace(results, summaries={})
    for draw in (lines_figure, heat_figure):
        assert draw(results) is not None
        assert draw(nothing) is None
    (tmp_path / "study.json").write_text('{"schema": 9}')
    with pytest.raises(DataError, match="version 9"):
        StudyResults.load_json(tmp_path / "study.json")


def test_the_share_under_every_condition_has_a_table_and_a_panel(roll, tmp_path):
    results, _ = study_of(CONDITIONS, tmp_path)
    # The perceived optimum is not among the policies.
    (table,) = score_tables(results)
    assert table.header == ("policy", *results.conditions)
    whole, locked = (found["mine"].normalized_score for found in results.summaries.values())
    assert table.rows[2] == ("mine", f"{whole:.2f}", f"{locked:.2f}")
    without, _ = study_of(CONDITIONS, tmp_path, {"no-motion": "no-motion", "mine": "mine"})
    assert [len(lines_figure(study).axes) for study in (results, without)] == [4, 2]
    assert lines_figure(results).axes[1].get_title("left").startswith("Normalized score")
    assert score_tables(without) == []


def test_a_value_near_0_does_not_squeeze_the_others(roll, tmp_path):
    results, _ = study_of(CONDITIONS, tmp_path)
    summaries = {
        name: {
            **found,
            "optimum": replace(found["optimum"], metrics={**found["optimum"].metrics, "cue_error": 1e-6}),
        }
        for name, found in results.summaries.items()
    }
    axes = lines_figure(replace(results, summaries=summaries)).axes[0]
    assert axes.get_ylim()[0] == pytest.approx(0.008)
    assert axes.get_title("right") == "▾ below 0.01"
    line = next(line for line in axes.lines if line.get_label() == "optimum")
    np.testing.assert_allclose(line.get_ydata(), 0.01)


def test_solves_that_went_wrong_are_told_by_condition_and_drive(roll, tmp_path):
    results, _ = study_of(CONDITIONS, tmp_path)
    counted = {"mpc_solves": "9", "mpc_relaxed": "2"}
    noted = replace(results, notes={"paper": {"mine": {"bend": counted}}})
    console = Console(width=300, file=io.StringIO())
    print_study(console, noted, "t", False)
    assert "counted mine: 2 of 9 solves with a limit relaxed (paper bend 2 of 9)" in console.file.getvalue()
