"""Washouts of any family by name or file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.baselines import make_policy, policy_names
from motion_cueing.baselines.tuning.search import TuningOptions
from motion_cueing.baselines.tuning.space import WashoutSpace
from motion_cueing.baselines.washout.families import (
    ALGORITHMS,
    algorithm_of,
    family_presets,
    load_of,
    load_parameters,
    make_washout,
)
from motion_cueing.envs.errors import ConfigurationError, UnknownNameError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import from_dict, save, to_dict

PAPER = get_platform("paper")


@pytest.mark.parametrize("family", ALGORITHMS)
def test_a_family_begins_with_its_preset_and_its_files_say_which_it_is(family, tmp_path):
    start = load_of(family, ALGORITHMS[family].start)
    assert algorithm_of(start) == family
    assert type(start) is ALGORITHMS[family].parameters
    save(replace(start, name="mine"), tmp_path / "mine.yaml")
    assert load_parameters(tmp_path / "mine.yaml") == replace(start, name="mine")
    assert make_policy(tmp_path / "mine.yaml", PAPER).name == "mine"
    assert make_washout(start, PAPER.cab).name == start.name


@pytest.mark.parametrize("family", ALGORITHMS)
def test_the_options_of_a_search_keep_the_family(family):
    options = TuningOptions(start=load_of(family, ALGORITHMS[family].start))
    again = from_dict(TuningOptions, to_dict(options))
    assert again == options
    assert type(again.start) is ALGORITHMS[family].parameters


@pytest.mark.parametrize("family", ALGORITHMS)
def test_the_space_of_a_family_is_that_of_its_parameters(family):
    start = load_of(family, ALGORITHMS[family].start)
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
