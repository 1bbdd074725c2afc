"""An object of the user's that has ``predict`` alone, through every command that takes a policy."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

from motion_cueing.baselines import make_policy
from motion_cueing.cli.arguments import find_policies
from motion_cueing.cli.main import main
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation import Trajectory

from ..evaluation.benchmark.small import small_split

pytestmark = pytest.mark.slow

MINE = """
import numpy as np

class Nudge:
    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        action = np.zeros((*np.shape(observation)[:-1], 9))
        action[..., 0] = 0.01
        return action, state

class Mute:
    pass

def make(platform):
    policy = Nudge()
    policy.name = "nudge-of-" + platform.name
    return policy

class Wild(Nudge):
    value = float("nan")
    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        step = (state or 0) + 1
        action = np.zeros((*np.shape(observation)[:-1], 9))
        action[..., 2] = self.value if step == 4 else 0.0
        return action, step

class Crash(Nudge):
    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        step = (state or 0) + 1
        return np.zeros(9)[9 if step == 3 else slice(None)], step

class Broken:
    def __init__(self):
        raise RuntimeError("out of order")
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a file of classes and a drive of 0.3 s."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "mine.py").write_text(MINE)
    monkeypatch.setattr("motion_cueing.evaluation.benchmark.SPLITS", {"small": small_split})
    monkeypatch.setattr("motion_cueing.evaluation.benchmark.splits.SPLITS", {"small": small_split})
    time = 0.01 * np.arange(31)
    force = np.column_stack([np.sin(time), np.zeros(31), np.full(31, -9.81)])
    CueTrace("short", time, force, np.zeros((31, 3))).to_csv(tmp_path / "short.csv")
    return tmp_path


DRIVE = ["--maneuvers", "short.csv"]
TEST = ["--axes", "f_x", "--frequencies", "15", "--settling", "0.1"]


@pytest.mark.parametrize(
    ("words", "file"),
    [
        (["evaluate", "--policies", "mine.py:Nudge", *DRIVE], "results.json"),
        (["benchmark", "--policies", "mine:Nudge", "no-motion"], "benchmark.json"),
        (["compare", "--policies", "mine.py:Nudge", "--platforms", "paper", *DRIVE], "study.json"),
        (["robustness", "--policies", "mine.py:Nudge", *DRIVE], "study.json"),
        (["frequency-response", "--policies", "mine.py:Nudge", *TEST], "frequency-response.json"),
        (
            ["endure", "--policies", "mine.py:Nudge", "--hours", "0.0002", "--duration", "1", "--envs", "1"],
            "endurance.json",
        ),
        (["demonstrate", "--policy", "mine.py:Nudge", *DRIVE], "index.json"),
    ],
    ids=lambda given: given[0] if isinstance(given, list) else "",
)
@pytest.mark.usefixtures("undrawn")
def test_it_is_driven_and_named_after_its_class(words, file, folder, capsys):
    status = main([*words, "--out", "out"])
    assert status == 0, capsys.readouterr()
    found = (folder / "out" / file).read_text()
    assert "Nudge" in found
    json.loads(found)


def test_it_is_drawn_and_served(folder, capsys):
    render = ["render", "--policy", "mine.py:Nudge", "--maneuver", "short.csv", "--size", "640", "360"]
    assert main([*render, "--out", "a.png"]) == 0
    assert "mine.py:Nudge in short.csv" in capsys.readouterr().out
    serve = ["serve", "--policy", "mine.py:Nudge", "--port", "0", "--rate", "100", "--duration", "0.2"]
    assert main([*serve, "--log", "log.npz"]) == 0
    assert len(Trajectory.load("log.npz")) > 2


@pytest.mark.usefixtures("undrawn")
def test_it_is_told_when_its_file_has_changed_that_drives_are_driven_anew(folder, capsys):
    words = ["compare", "--policies", "mine.py:Nudge", "--platforms", "paper", *DRIVE, "--out", "out"]
    driven = []
    for edit in ("", "", "\n# edited\n"):
        (folder / "mine.py").write_text(MINE + edit)
        assert main(words) == 0
        driven.append(capsys.readouterr().out.splitlines()[-1].split()[0])
    assert driven == ["1", "0", "1"]


@pytest.mark.parametrize(
    ("policy", "told"),
    [
        ("mine.py:Mute", ": Mute is no policy: it has no method predict"),
        ("mine.py:Broken", "policy mine.py:Broken: RuntimeError: out of order (mine.py:33)"),
        ("mine.py:Nuge", "policy mine.py:Nuge: mine.py has no 'Nuge'. Did you mean Nudge"),
        ("nowhere.py:Nudge", "policy nowhere.py:Nudge: nowhere.py: there is no such file"),
        ("no.such.module:Nudge", "policy no.such.module:Nudge: no module 'no' in the current folder"),
    ],
)
def test_what_is_wrong_with_it_is_told_in_one_line(policy, told, folder, capsys):
    assert main(["evaluate", "--policies", policy, *DRIVE, "--out", "out"]) == 2
    assert told in capsys.readouterr().err
    assert not (folder / "out").exists()


@pytest.mark.parametrize(
    ("policy", "told"),
    [
        ("mine.py:Wild", "failed short, Wild: the action of Wild at step 4 is not finite: entry 2 is nan"),
        (
            "mine.py:Crash",
            "Crash raised IndexError: index 9 is out of bounds for axis 0 with size 9 at step 3",
        ),
    ],
)
def test_a_failed_drive_says_the_step_and_the_line(policy, told, folder, capsys):
    assert main(["evaluate", "--policies", policy, *DRIVE, "--out", "out"]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert told in said
    assert "Crash" not in policy or "at step 3 (mine.py:29)" in said


def test_a_module_of_the_current_folder_is_found_and_a_file_finds_its_neighbors(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.path", list(sys.path))
    for module in ("beside_a", "beside_b"):
        monkeypatch.delitem(sys.modules, module, raising=False)
    (tmp_path / "deeper").mkdir()
    (tmp_path / "beside_a.py").write_text(MINE)
    (tmp_path / "deeper" / "beside_b.py").write_text(MINE)
    (tmp_path / "deeper" / "file.py").write_text("from beside_b import Nudge\n")
    monkeypatch.chdir(tmp_path)
    platform = get_platform("paper")
    assert list(find_policies(["beside_a:Nudge", "deeper/file.py:Nudge"], platform)) == ["Nudge", "Nudge-2"]


def test_a_factory_is_named_as_its_policy_names_itself(folder):
    platform = get_platform("paper")
    assert find_policies(["mine.py:make"], platform) == {"nudge-of-paper": "mine.py:make"}


def test_a_file_runs_once(folder):
    (folder / "counted.py").write_text(MINE + "print('run')\nopen('runs', 'a').write('x')\n")
    for _ in range(2):
        make_policy("counted.py:Nudge", get_platform("paper"))
    assert (folder / "runs").read_text() == "x"


def test_a_file_that_is_no_drive_is_refused_in_plain_words(folder, capsys):
    for file, told in (("nowhere.npz", "there is no such file"), ("mine.py", "no .npz file, or broken")):
        assert main(["evaluate", "--replays", file, "--out", "out"]) == 2
        said = capsys.readouterr().err
        assert told in said
        assert "Errno" not in said
        assert "pickle" not in said
