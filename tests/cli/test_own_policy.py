"""An object of the user's that has ``predict`` alone, through every command that takes a policy."""

from __future__ import annotations

import json

import numpy as np
import pytest

from motion_cueing.cli.main import main
from motion_cueing.envs.cues import CueTrace
from motion_cueing.evaluation import Trajectory

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
        (["benchmark", "--policies", "mine:Nudge", "no-motion", *DRIVE], "results.json"),
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
        ("mine.py:Mute", "is no policy: it has no method predict"),
        ("mine.py:Broken", "policy mine.py:Broken: RuntimeError: out of order"),
        ("mine.py:Nuge", "policy mine.py:Nuge: AttributeError"),
        ("nowhere.py:Nudge", "policy nowhere.py:Nudge: FileNotFoundError: nowhere.py: there is no such file"),
        ("no.such.module:Nudge", "policy no.such.module:Nudge: ModuleNotFoundError"),
    ],
)
def test_what_is_wrong_with_it_is_told_in_one_line(policy, told, folder, capsys):
    assert main(["evaluate", "--policies", policy, *DRIVE, "--out", "out"]) == 2
    assert told in capsys.readouterr().err
    assert not (folder / "out").exists()
