"""Machines with locked subsystems, and policies on machines that they were not made for."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.baselines import NoMotion
from motion_cueing.envs.errors import ConfigurationError, UnknownNameError
from motion_cueing.envs.platform import ablation_names, ablations, get_platform, platform_names
from motion_cueing.envs.task import TaskOptions
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.evaluation.rollout import rollout

from .bends import PAPER, bend


def policy_on(name, platform):
    return make_policy(name, platform, force=True)


def test_ablations_lock_what_a_machine_has():
    assert [one.name for one in ablations(PAPER)] == [
        "paper-no-turntable",
        "paper-no-carriage",
        "paper-hexapod-only",
    ]
    assert [one.name for one in ablations(get_platform("24-inch"))] == ["24-inch-no-turntable"]
    assert ablations(get_platform("dim-hexapod")) == []
    for name in ablation_names():
        one = get_platform(name)
        assert one.name == name
        assert name not in platform_names()
        assert TaskOptions(platform=name).platform == name
    alone = get_platform("nads-1-hexapod-only")
    assert (alone.carriage, alone.turntable) == (None, None)
    assert alone.hexapod == get_platform("nads-1").hexapod
    with pytest.raises(UnknownNameError, match="paper-no-carriage"):
        get_platform("paper-no-carrage")


def test_a_washout_without_turntable_yaws_with_its_hexapod():
    for name in ("classical", "adaptive", "optimal-washout"):
        assert policy_on(name, get_platform("paper-no-turntable")).parameters.turntable_share == 0.0
        assert policy_on(name, PAPER).parameters.turntable_share > 0.0
    oracle = policy_on("classical-per-maneuver", get_platform("paper-no-turntable")).parameters
    assert {found.turntable_share for found in oracle.sets.values()} == {0.0}
    yaw = []
    for fit in (policy_on, make_policy):
        machine = get_platform("paper-no-turntable")
        felt = rollout(fit("classical", machine), bend(), machine).w_simulator
        yaw.append(np.abs(felt[:, 2]).max())
    assert yaw[0] > 0.05
    assert yaw[1] < 1e-3


def test_an_agent_is_forced_onto_another_machine():
    machine = get_platform("paper-hexapod-only")
    drive_ = rollout(policy_on("learned-preview", machine), bend(), machine)
    assert not drive_.carriage.any()
    assert not drive_.turntable.any()
    assert np.abs(drive_.hexapod).max() > 1e-4
    with pytest.raises(ConfigurationError):
        make_policy("learned-preview", machine)
    assert make_policy("learned-preview", PAPER).on(machine).platform == machine
    still = NoMotion()
    assert still.on(machine) is still
