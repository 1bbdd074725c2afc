"""What a person sees while a training runs: references, warnings, the line of a validation."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console

from motion_cueing.train.experiments.seeds import TrainingProgress, validation_line
from motion_cueing.train.training import Status
from motion_cueing.train.validation import Score
from motion_cueing.train.watch import References, Watch

GOOD = Score(4.0, 5.0, -4.0, {"limits": 0.0}, 0.02, carriage_travel=0.46, leg_travel=0.71, noise=0.12)
BESIDE = References(washout=7.24, standing=8.6, start=5.43)


def test_all_is_well_without_a_warning():
    watch = Watch()
    assert [watch.look(GOOD, BESIDE) for _ in range(9)] == [[]] * 9


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"at_ends": 0.31}, "drifts to its ends: it is at one 31 % of the time"),
        ({"noise": 9.0}, "exploring costs more than the error itself: J 4, with it 13"),
        ({"cue_error": 10.86}, "J is 10.9, 100 % above that of the controller it began with (5.43)"),
    ],
)
def test_a_warning_is_given_once_and_again_when_its_cause_was_gone(fields, words):
    watch, bad = Watch(), replace(GOOD, **fields)
    (sentence,) = watch.look(bad, BESIDE)
    assert words in sentence
    assert watch.look(bad, BESIDE) == []
    assert watch.look(GOOD, BESIDE) == []
    assert watch.look(bad, BESIDE) == [sentence]


def test_a_little_worse_is_no_warning():
    watch = Watch()
    assert watch.look(replace(GOOD, cue_error=1.09 * 5.43, noise=None), BESIDE) == []


def test_nothing_learned_for_long_is_said_after_five_validations_and_survives_a_stop():
    watch, same = Watch(), replace(GOOD, cue_error=5.42)
    assert [watch.look(same, BESIDE) for _ in range(3)] == [[]] * 3
    resumed = Watch()
    resumed.restore(watch.state())
    assert [resumed.look(same, BESIDE) for _ in range(2)] == [[]] * 2
    (sentence,) = resumed.look(same, BESIDE)
    assert "nothing is learned yet: after 5 validations the best J is 5.42" in sentence
    assert resumed.look(same, BESIDE) == []
    # Something is: and stays so, although the next is no better.
    assert resumed.look(GOOD, BESIDE) == []
    assert resumed.look(same, BESIDE) == []


def test_without_the_start_nothing_is_compared_with_it():
    watch, bad = Watch(), replace(GOOD, cue_error=99.0)
    assert [watch.look(bad, References(washout=7.24)) for _ in range(9)] == [[]] * 9


def test_the_line_names_what_is_known():
    status = Status(1_250_000, 2_000_000, GOOD, references=BESIDE, drive_share=0.84, entropy=2.31, kl=0.0123)
    assert validation_line(status) == (
        "1.25M J 4.00 (washout 7.24 still 8.60 start 5.43) noise +0.12 drive 84% travel 46/71% limits 0.0% "
        "entropy 2.3 KL 0.012"
    )
    few = Status(320, 640, replace(GOOD, noise=None))
    assert validation_line(few) == "  320 J 4.00 travel 46/71% limits 0.0%"


@pytest.mark.parametrize(("steps", "short"), [(0, "0"), (12_800, "12.8k"), (999_500, "1M"), (10**8, "100M")])
def test_steps_are_short(steps, short):
    assert validation_line(Status(steps, steps, GOOD)).split()[0] == short


def test_the_line_has_room_for_a_training_that_goes_wrong():
    score = replace(GOOD, cue_error=572.0, noise=-901.0, carriage_travel=1.0, leg_travel=1.0)
    beside = References(12.4, 12.5, 18.8)
    status = Status(999_900, 1, score, references=beside, drive_share=1.0, entropy=-5.1, kl=0.02)
    assert len(validation_line(status)) <= 120


def test_progress_shows_lines_and_warnings():
    out = io.StringIO()
    with TrainingProgress(console=Console(file=out, width=300)) as progress:
        progress.tell(Status(0, 10, warnings=["it will not learn"]))
        progress.tell(Status(5, 10, GOOD, news=True, warnings=["it does not learn"]))
        progress.tell(Status(10, 10, GOOD))
    assert out.getvalue().splitlines() == [
        "warning: it will not learn",
        "    5 J 4.00 noise +0.12 travel 46/71% limits 0.0%",
        "warning: it does not learn",
    ]
