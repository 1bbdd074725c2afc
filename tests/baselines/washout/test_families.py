"""Washouts of any family by name or file."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from motion_cueing.baselines import make_policy, policy_names
from motion_cueing.baselines.registry import POLICIES
from motion_cueing.baselines.tuning.objective import WashoutSpace
from motion_cueing.baselines.tuning.search import TuningOptions
from motion_cueing.baselines.washout import WashoutParameters
from motion_cueing.baselines.washout.batch import WashoutBatch
from motion_cueing.baselines.washout.families import (
    FAMILIES,
    algorithm_of,
    family_presets,
    load_of,
    load_parameters,
    register_family,
)
from motion_cueing.baselines.washout.policy import make_washout
from motion_cueing.envs.errors import ConfigurationError, UnknownNameError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import configuration, from_dict, save, to_dict
from motion_cueing.evaluation import measure, rollout

from ..drives import trace

PAPER = get_platform("paper")


@pytest.mark.parametrize("family", FAMILIES.names())
def test_a_family_begins_with_its_preset_and_its_files_say_which_it_is(family, tmp_path):
    start = load_of(family, FAMILIES[family].start)
    assert algorithm_of(start) == family
    assert type(start) is FAMILIES[family].parameters
    save(replace(start, name="mine"), tmp_path / "mine.yaml")
    assert load_parameters(tmp_path / "mine.yaml") == replace(start, name="mine")
    assert make_policy(tmp_path / "mine.yaml", PAPER).name == "mine"
    assert make_washout(start, PAPER.cab).name == start.name


@pytest.mark.parametrize("family", FAMILIES.names())
def test_the_options_of_a_search_keep_the_family(family):
    options = TuningOptions(start=load_of(family, FAMILIES[family].start))
    again = from_dict(TuningOptions, to_dict(options))
    assert again == options
    assert type(again.start) is FAMILIES[family].parameters


@pytest.mark.parametrize("family", FAMILIES.names())
def test_the_space_of_a_family_is_that_of_its_parameters(family):
    start = load_of(family, FAMILIES[family].start)
    space = WashoutSpace(start)
    middle = np.full(len(space), 0.5)
    found = space.decode(middle)
    assert type(found) is type(start)
    np.testing.assert_allclose(space.encode(found), middle, atol=1e-9)
    # Every coordinate has an effect of its own.
    moved = [space.decode(np.where(np.arange(len(space)) == i, 0.6, 0.5)) for i in range(len(space))]
    assert len({str(p) for p in [found, *moved]}) == len(space) + 1


def test_all_presets_are_policies_and_no_name_is_given_twice():
    names = family_presets()
    assert len(set(names)) == len(names)
    assert set(names) <= set(policy_names())
    assert {"classical", "adaptive", "optimal-washout"} <= set(names)


def test_what_is_unknown_or_of_another_family_is_refused(tmp_path):
    with pytest.raises(UnknownNameError, match="Did you mean adaptive"):
        load_parameters("adaptiv")
    with pytest.raises(ConfigurationError, match="is a set of the classical washout; give one of the"):
        load_of("optimal", "classical")
    (tmp_path / "odd.yaml").write_text("name: x\nalgorithm: adaptve\n")
    with pytest.raises(ConfigurationError, match=r"odd\.yaml: field 'algorithm' is 'adaptve'; it is one of"):
        load_parameters(tmp_path / "odd.yaml")
    (tmp_path / "mixed.yaml").write_text("name: x\nadaptation: {}\n")
    with pytest.raises(ConfigurationError, match="unknown field 'adaptation'"):
        load_parameters(tmp_path / "mixed.yaml")


@configuration
class MineParameters(WashoutParameters):
    """Parameters of a family of another package."""

    algorithm: Literal["mine"] = "mine"


def test_a_family_of_another_package_takes_one_registration(tmp_path):
    """Its presets are policies, its files are read, batches drive it and a search tunes it."""
    save(MineParameters("mine-by-hand", force_scale=(0.4, 0.4, 0.4)), tmp_path / "mine-by-hand.yaml")
    classical = FAMILIES["classical"]
    mine = replace(
        classical,
        name="mine",
        title="my washout",
        parameters=MineParameters,
        presets=tmp_path,
        start="mine-by-hand",
        coordinates=classical.coordinates[:3],
    )
    register_family("mine", mine)
    try:
        assert "mine-by-hand" in policy_names()
        policy = make_policy("mine-by-hand", PAPER)
        assert policy.family is mine
        assert pickle.loads(pickle.dumps(policy)).parameters == policy.parameters
        cues = trace(1.0, lambda t: np.column_stack([np.sin(t), 0.0 * t]))
        start = load_of("mine", "mine-by-hand")
        scores = WashoutBatch([start], [cues], PAPER).scores()
        expected = measure(rollout(policy, cues, PAPER)).cue_error
        assert scores.cue_error[0, 0] == pytest.approx(expected, rel=1e-9)
        options = TuningOptions(start=start)
        assert from_dict(TuningOptions, to_dict(options)) == options
        assert [c.path for c in WashoutSpace(start).coordinates] == [f"force_scale.{i}" for i in range(3)]
    finally:
        # A registry has no way to forget, and other tests list all families.
        del FAMILIES._entries["mine"]
        POLICIES._entries.pop("mine-by-hand", None)
