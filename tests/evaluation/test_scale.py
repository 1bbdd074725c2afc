"""Evaluation at a motion scale: policies and J see the same reference, and unequal scales do not mix."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motion_cueing.baselines import make_policy
from motion_cueing.cli.evaluate import EvaluateCommand, evaluate, make_plan
from motion_cueing.envs.cues import GRAVITY, UNSCALED, CueScale
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.metrics import measure
from motion_cueing.evaluation.reporting.tables import suite_table
from motion_cueing.evaluation.results import Results
from motion_cueing.evaluation.rollout import rollout
from motion_cueing.evaluation.suite import cues_of, scale_of
from motion_cueing.evaluation.trajectory import Trajectory

HALF = CueScale.parse("0.5")


@pytest.fixture(scope="module")
def lane_change():
    return get_maneuver("lane-change").drive()


def test_standing_still_costs_the_square_of_the_scale(lane_change):
    """J is the mean square of the missing cue."""
    platform = get_platform("paper")
    whole, half = (
        measure(rollout(make_policy("no-motion", platform), cues, platform)).cue_error
        for cues in (lane_change, lane_change.scaled(HALF))
    )
    assert half == pytest.approx(0.25 * whole, rel=1e-9)


def test_a_policy_sees_the_scaled_reference(lane_change):
    """A washout that hardly filters moves half as far across; along, it moves by the product of two cues."""
    platform = get_platform("paper")
    whole, half = (
        rollout(make_policy("lc1", platform), cues, platform)
        for cues in (lane_change, lane_change.scaled(HALF))
    )
    np.testing.assert_allclose(half.carriage[:, 1], 0.5 * whole.carriage[:, 1], atol=0.02)
    rest = np.array([0.0, 0.0, -GRAVITY])
    np.testing.assert_allclose(half.f_reference - rest, 0.5 * (whole.f_reference - rest), atol=1e-12)
    assert half.scale == HALF
    assert whole.scale == UNSCALED
    assert "scale" not in whole.metadata
    # LC1 is an almost perfect machine at either scale.
    assert measure(half).cue_error < 1e-3


def test_a_perfect_machine_has_no_error_at_any_scale(lane_change):
    platform = get_platform("paper")
    drive = rollout(make_policy("no-motion", platform), lane_change.scaled(HALF), platform)
    perfect = replace(drive, f_simulator=drive.f_reference, w_simulator=drive.w_reference)
    assert measure(perfect).cue_error == 0.0
    # The same machine, judged by the car's own cues, is wrong.
    unscaled = rollout(make_policy("no-motion", platform), lane_change, platform)
    judged = replace(unscaled, f_simulator=drive.f_reference, w_simulator=drive.w_reference)
    assert measure(judged).cue_error > 0.1


def test_a_saved_drive_keeps_its_scale(lane_change, tmp_path):
    platform = get_platform("paper")
    drive = rollout(make_policy("no-motion", platform), lane_change.scaled(HALF), platform)
    drive.save(tmp_path / "drive.npz")
    loaded = Trajectory.load(tmp_path / "drive.npz")
    assert loaded.scale == HALF
    assert cues_of(loaded, "again").scale == HALF


def test_drives_of_different_scales_are_not_evaluated_together(lane_change):
    platform = get_platform("paper")
    drives = {
        text: rollout(make_policy("no-motion", platform), lane_change.scaled(CueScale.parse(text)), platform)
        for text in ("0.5", "0.6")
    }
    assert scale_of({"a": drives["0.5"]}) == HALF
    assert scale_of({}) == UNSCALED
    with pytest.raises(ConfigurationError, match="different motion scales"):
        scale_of(drives)


def test_results_say_their_scale(tmp_path):
    command = EvaluateCommand(
        policies=("no-motion", "classical"),
        maneuvers=("lane-change",),
        scale="force=0.6,rates=0.5",
        out=tmp_path,
    )
    results, _ = evaluate(make_plan(command, ["motion-cueing", "evaluate"]))
    results.save_json(tmp_path / "results.json")
    saved = json.loads((tmp_path / "results.json").read_text())
    assert saved["provenance"]["scale"] == {"force": [0.6] * 3, "rates": [0.5] * 3}
    assert Results.load_json(tmp_path / "results.json").provenance.scale == CueScale.parse(command.scale)
    assert suite_table(results).title == "One drive, motion scale force=0.6,rates=0.5"


def test_recorded_drives_are_not_scaled_again(tmp_path):
    command = EvaluateCommand(replays=(Path("drive.npz"),), scale="0.5", out=tmp_path)
    with pytest.raises(ConfigurationError, match="leave --scale out"):
        make_plan(command, ["motion-cueing", "evaluate"])
