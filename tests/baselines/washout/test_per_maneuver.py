"""The oracle classical-per-maneuver: one set a maneuver, and none for a drive it was not tuned on."""

from __future__ import annotations

import pickle
import shutil
from dataclasses import replace

import pytest

from motion_cueing.baselines import make_policy
from motion_cueing.baselines.washout import PerManeuverWashout, load_washout
from motion_cueing.baselines.washout.batch import WashoutBatch
from motion_cueing.baselines.washout.classical import policies as per_maneuver
from motion_cueing.baselines.washout.classical.policies import load_per_maneuver, tuned_maneuvers
from motion_cueing.envs.errors import UnknownNameError
from motion_cueing.envs.maneuvers import get_maneuver, maneuver_names
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import to_dict
from motion_cueing.evaluation import measure, rollout

from ..drives import trace

PAPER = get_platform("paper")
LOCKED = get_platform("paper-no-turntable")


def test_there_is_a_set_for_every_standard_maneuver_and_it_is_better_than_the_others():
    assert set(maneuver_names()) <= set(tuned_maneuvers())
    for name in ("lane-change", "step-steer", "sine-with-dwell"):
        sets = [load_per_maneuver(name), load_washout("classical"), load_washout("classical-tuned")]
        scores = WashoutBatch(sets, [get_maneuver(name).drive()], PAPER).scores()
        assert scores.cue_error[0, 0] < scores.cue_error[1:, 0].min()
        assert scores.at_limit[0, 0] == 0.0


def test_it_goes_by_the_name_of_the_maneuver():
    policy = make_policy("classical-per-maneuver", PAPER)
    assert policy.needs_drive
    cues = get_maneuver("lane-change").drive()
    drive = rollout(policy, cues, PAPER)
    assert drive.policy == "classical-per-maneuver"
    expected = WashoutBatch([load_per_maneuver("lane-change")], [cues], PAPER).scores().cue_error[0, 0]
    assert measure(drive).cue_error == pytest.approx(expected, rel=1e-9)
    with pytest.raises(
        UnknownNameError, match=r"classical-per-maneuver 'lane-chang'\. Did you mean lane-change"
    ):
        policy.for_drive(replace(cues, name="lane-chang"))
    with pytest.raises(UnknownNameError, match="maneuver of classical-per-maneuver 'test'"):
        rollout(policy, trace(0.2), PAPER)


def test_without_a_turntable_it_yaws_with_the_hexapod():
    """Where the share of the turntable were lost, most of the lane change's yaw would be: J 0.18."""
    cues = get_maneuver("lane-change").drive()
    found = measure(rollout(PerManeuverWashout(LOCKED), cues, LOCKED)).cue_error
    assert found < 0.01
    hexapod = replace(load_per_maneuver("lane-change"), turntable_share=0.0)
    expected = WashoutBatch([hexapod], [cues], LOCKED).scores().cue_error[0, 0]
    assert found == pytest.approx(expected, rel=1e-9)


def test_its_name_and_its_sets_survive_a_copy():
    policy = pickle.loads(pickle.dumps(PerManeuverWashout(LOCKED)))
    assert policy.parameters == PerManeuverWashout(LOCKED).parameters
    washout = policy.for_drive(get_maneuver("lane-change").drive())
    assert pickle.loads(pickle.dumps(washout)).name == washout.name == "classical-per-maneuver"


def test_a_set_that_is_edited_shows_in_its_parameters(tmp_path, monkeypatch):
    before = PerManeuverWashout(PAPER).parameters
    assert list(before.sets) == tuned_maneuvers()
    shutil.copytree(per_maneuver._SETS, tmp_path / "sets")
    monkeypatch.setattr(per_maneuver, "_SETS", tmp_path / "sets")
    assert to_dict(PerManeuverWashout(PAPER).parameters) == to_dict(before)
    file = tmp_path / "sets" / "lane-change.yaml"
    share = f"turntable_share: {before.sets['lane-change'].turntable_share}"
    file.write_text(file.read_text().replace(share, "turntable_share: 0.5"))
    assert PerManeuverWashout(PAPER).parameters.sets["lane-change"].turntable_share == 0.5
    assert to_dict(PerManeuverWashout(PAPER).parameters) != to_dict(before)


def test_the_name_of_before_is_answered_with_the_new_one():
    with pytest.raises(UnknownNameError, match="it is called 'classical-per-maneuver' now"):
        make_policy("classical-ceiling", PAPER)
