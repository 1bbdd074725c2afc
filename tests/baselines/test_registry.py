"""Names of policies: of this package, and those that others register or bring by entry point."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from motion_cueing.baselines import describe_policy, make_policy, policy_names, register
from motion_cueing.baselines.registry import POLICIES
from motion_cueing.baselines.washout.families import family_presets, load_parameters
from motion_cueing.envs.errors import ConfigurationError, DataError, UnknownNameError
from motion_cueing.envs.platform import get_platform

from ..repository import ROOT

pytestmark = pytest.mark.slow

PAPER = get_platform("paper")

CONTROLLER = """
import numpy as np
from motion_cueing.baselines import register

class Mine:
    def __init__(self, platform):
        self.name = f"mine on {platform.name}"

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.full((len(observation), 9), 0.01), state

register("mine", Mine, "registered by a call")
register("later", "my_controllers:Mine", "found when it is needed")
"""

USE = """
import json, sys
from motion_cueing.baselines import policy_names, describe_policy, make_policy
before = {name: describe_policy(name) for name in policy_names()}
light = "warp" not in sys.modules
import my_controllers
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.evaluation import rollout
paper, cues = get_platform("paper"), get_maneuver("step-steer").drive().resampled(0.1)
names = ("pointed", "mine", "later")
driven = {name: rollout(make_policy(name, paper), cues, paper).policy for name in names}
print(json.dumps([light, before, policy_names(), driven]))
"""


@pytest.fixture
def package(tmp_path):
    """A folder with another package, as pip would install it."""
    (tmp_path / "my_controllers.py").write_text(CONTROLLER)
    about = tmp_path / "my_controllers-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my-controllers\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[motion_cueing.policies]\npointed = my_controllers:Mine\n")
    return tmp_path


def test_another_package_adds_policies_by_a_call_and_by_entry_point(package):
    path = os.pathsep.join([str(package), *sys.path])
    ran = subprocess.run(
        [sys.executable, "-c", USE],
        env={**os.environ, "PYTHONPATH": path},
        cwd=ROOT.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    light, before, names, driven = json.loads(ran.stdout.splitlines()[-1])
    assert light, "a list of names must not import Warp"
    assert before["pointed"] == "from my-controllers"
    assert "mine" not in before
    assert {"pointed", "mine", "later"} <= set(names)
    assert set(driven.values()) == {"mine on paper"}


def test_what_cannot_be_a_name_is_refused(monkeypatch):
    # Private, as a registry has no other way to forget a name.
    monkeypatch.setattr(POLICIES, "_entries", dict(POLICIES._entries))
    with pytest.raises(ConfigurationError, match="registered already"):
        register("classical", lambda platform: None)
    with pytest.raises(ConfigurationError, match="not one word"):
        register("mine.yaml", lambda platform: None)
    register("lost", "no_such_package:make")
    with pytest.raises(ConfigurationError, match="needs no_such_package"):
        make_policy("lost", PAPER)
    register("empty", lambda platform: None)
    with pytest.raises(ConfigurationError, match="no method predict"):
        make_policy("empty", PAPER)


def test_an_old_name_is_answered_with_the_new_one():
    with pytest.raises(UnknownNameError, match="it is called 'classical-per-maneuver' now"):
        make_policy("classical-ceiling", PAPER)
    with pytest.raises(UnknownNameError, match="Did you mean classical"):
        make_policy("clasical", PAPER)


def test_files_are_read_by_their_ending(tmp_path):
    with pytest.raises(DataError, match=r"there is no such file|cannot be read"):
        make_policy("missing.yaml", PAPER)
    (tmp_path / "policy.pkl").write_bytes(b"PK")
    with pytest.raises(DataError, match=r"not a policy; .* one of .*\.yaml"):
        make_policy(tmp_path / "policy.pkl", PAPER)
    (tmp_path / "mine.yaml").write_text("algorithm: mpc\n")
    assert make_policy(tmp_path / "mine.yaml", PAPER).name == "mine"


def test_an_object_of_ones_own_by_module_or_file(tmp_path, monkeypatch):
    (tmp_path / "given.py").write_text(
        "class Mine:\n"
        "    def __init__(self, platform): self.name = platform.name\n"
        "    def predict(self, observation, state=None, episode_start=None, deterministic=True): ...\n"
        "def made(): return Mine(Mine)\n"
        "Mine.name = 'class'\n"
        "ready, broken = made(), 3\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    for module in ("given", str(tmp_path / "given.py")):
        assert make_policy(f"{module}:Mine", PAPER).name == "paper"
        assert make_policy(f"{module}:made", PAPER).name == "class"
        assert make_policy(f"{module}:ready", PAPER).name == "class"
        with pytest.raises(ConfigurationError, match="no method predict"):
            make_policy(f"{module}:broken", PAPER)
        with pytest.raises(ConfigurationError, match="has no 'missing'"):
            make_policy(f"{module}:missing", PAPER)
    with pytest.raises(ConfigurationError, match="there is no such file"):
        make_policy(str(tmp_path / "none.py:Mine"), PAPER)


def test_presets_are_described_as_in_their_files():
    assert set(family_presets()) < set(policy_names())
    for name in family_presets():
        assert describe_policy(name) == load_parameters(name).description
    assert all(describe_policy(name) for name in policy_names())
