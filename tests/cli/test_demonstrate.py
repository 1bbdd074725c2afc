"""Demonstrations: what is recorded is what happened; recordings go on, and broken ones are refused."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.baselines import ClassicalWashout, NoMotion
from motion_cueing.baselines.washout.classical import per_maneuver
from motion_cueing.baselines.washout.classical.per_maneuver import load_per_maneuver
from motion_cueing.cli.main import main
from motion_cueing.envs.car import get_car
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.perception import get_vestibular_model
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import save
from motion_cueing.envs.simulator.kernels.observation import read
from motion_cueing.evaluation import measure, rollout
from motion_cueing.evaluation.demonstrations import Demonstrator, demonstrate
from motion_cueing.train.algorithms.dagger.demonstrations import (
    Demonstration,
    load_demonstrations,
    load_index,
)

from ..baselines.optimum.drives import surge

WASHOUT = ("--policy", "classical")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MOTION_CUEING_CACHE", str(tmp_path / "kept"))
    return tmp_path / "demonstrations"


def record(*words: str) -> int:
    return main(["demonstrate", *words])


def test_a_recording_is_what_happened(folder):
    assert record(*WASHOUT, "--maneuvers", "sine-with-dwell") == 0
    (drive,) = load_demonstrations(folder)
    (entry,) = load_index(folder).drives
    cues = get_maneuver("sine-with-dwell").drive()
    wanted = rollout(ClassicalWashout("classical"), cues)
    assert len(drive) == entry.steps == len(cues) - 1
    assert entry.cue_error == pytest.approx(measure(wanted).cue_error, rel=1e-12)
    assert np.array_equal(drive.action, wanted.action[1:])
    assert np.array_equal(drive.force, cues.specific_force[:-1])
    assert np.array_equal(drive.velocity[:, 2:8], wanted.hexapod_rate[:-1])
    assert np.allclose(read(drive.observation, "carriage"), drive.position[:, :2], atol=1e-12)
    assert np.allclose(read(drive.observation, "reference_rate"), cues.angular_velocity[:-1], atol=1e-12)


def test_the_optimum_demonstrates(folder, tmp_path, capsys):
    surge(1.0, 1.0).to_csv(tmp_path / "surge.csv")
    assert record("--maneuvers", "surge.csv") == 0
    told = capsys.readouterr().out
    (entry,) = load_index(folder).drives
    assert entry.name == "surge"
    assert entry.cue_error < 0.01
    assert float(told.split("mean J ")[1]) == pytest.approx(entry.cue_error, rel=0.01)
    assert entry.at_limit == 0.0
    assert entry.notes["optimum_unconverged"] == "0"
    assert load_index(folder).setting["policy"] == "optimum"


def test_a_recording_goes_on_where_it_was_stopped(folder, capsys):
    words = (*WASHOUT, "--drives", "2", "--duration", "4", "--seed", "3")
    assert record(*words) == 0
    first = load_index(folder)
    assert len(first.drives) == 2
    (folder / first.drives[1].file).unlink()
    before = (folder / first.drives[0].file).stat().st_mtime_ns
    assert record(*words, "--maneuvers", "sine-with-dwell") == 0
    assert "3 drives (2 new)" in capsys.readouterr().out
    again = load_index(folder)
    assert {drive.name: drive.sha256 for drive in first.drives}.items() <= {
        drive.name: drive.sha256 for drive in again.drives
    }.items()
    assert (folder / first.drives[0].file).stat().st_mtime_ns == before
    assert again.provenance == first.provenance


def test_fresh_begins_anew_even_with_another_controller(folder, capsys):
    words = ("--drives", "1", "--duration", "1", "--seed", "3")
    assert record(*WASHOUT, *words) == 0
    (folder / "notes.txt").write_text("mine")
    assert record("--policy", "no-motion", *words) == 2
    assert "name another --out, or add --fresh to begin anew" in capsys.readouterr().err
    assert record("--policy", "no-motion", *words, "--fresh") == 0
    assert "1 drives (1 new)" in capsys.readouterr().out
    assert load_index(folder).setting["policy"] == "no-motion"
    assert (folder / "notes.txt").read_text() == "mine"


def test_a_drive_whose_cues_have_changed_is_recorded_anew(folder, tmp_path, capsys):
    for name in ("first", "second"):
        surge(1.0, 1.0).to_csv(tmp_path / f"{name}.csv")
    words = (*WASHOUT, "--maneuvers", "first.csv", "second.csv")
    assert record(*words) == 0
    before = {drive.name: drive for drive in load_index(folder).drives}
    assert before["first"].cues == CueTrace.from_csv("first.csv").digest()
    capsys.readouterr()
    changed = surge(1.0, 1.5)
    changed.to_csv(tmp_path / "second.csv")
    assert record(*words) == 0
    shown = capsys.readouterr().out
    assert "second: its cues are not those that were recorded; recorded anew" in shown
    assert "2 drives (1 new)" in shown
    after = {drive.name: drive for drive in load_index(folder).drives}
    assert after["first"] == before["first"]
    assert after["second"].cues != before["second"].cues
    force = {drive.name: drive.force for drive in load_demonstrations(folder)}
    np.testing.assert_allclose(force["second"], changed.specific_force[:-1], atol=1e-7)
    assert record(*words) == 0
    assert "2 drives (0 new)" in capsys.readouterr().out


def test_a_car_whose_file_has_changed_is_refused(folder, tmp_path, capsys):
    car = get_car("sedan")
    words = (*WASHOUT, "--maneuvers", "sine-with-dwell", "--car", "mine.yaml")
    save(replace(car, name="mine"), tmp_path / "mine.yaml")
    assert record(*words) == 0
    assert load_index(folder).setting["car"]["mass"] == car.mass
    assert record(*words) == 0
    save(replace(car, name="mine", mass=1.1 * car.mass), tmp_path / "mine.yaml")
    capsys.readouterr()
    assert record(*words) == 2
    assert "holds drives of another controller, car" in capsys.readouterr().err


def test_an_oracle_of_other_sets_is_refused(folder, monkeypatch, capsys):
    words = ("--policy", "classical-per-maneuver", "--maneuvers", "sine-with-dwell")
    assert record(*words) == 0
    edited = replace(load_per_maneuver("sine-with-dwell"), turntable_share=0.25)
    monkeypatch.setattr(per_maneuver, "load_per_maneuver", lambda name: edited)
    assert record(*words) == 2
    assert "holds drives of another controller" in capsys.readouterr().err


class Counter:
    """Counts its answers."""

    dt = 0.01

    def __init__(self):
        self.notes = {"solves": "0"}

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        self.notes = {"solves": str(int(self.notes["solves"]) + 1)}
        return np.zeros(9), None


def test_a_demonstrator_is_watched_as_it_is():
    cues = surge(1.0, 1.0)
    one = Demonstrator("mine", Counter(), get_platform("paper"), get_vestibular_model("zacharias"))
    drive, _ = demonstrate(one, "surge", cues)
    assert (drive.policy, drive.metadata["solves"]) == ("Counter", str(len(cues) - 1))
    slow, seen = demonstrate(replace(one, policy=NoMotion(), time_step=0.02), "surge", cues)
    assert slow.dt == pytest.approx(0.02)
    assert np.allclose(np.diff(seen.time), 0.02)
    with pytest.raises(ConfigurationError, match=r"time step is 0\.01 s"):
        demonstrate(replace(one, time_step=0.02), "surge", cues)


def test_a_folder_of_another_controller_is_refused(folder, capsys):
    assert record(*WASHOUT, "--drives", "1", "--duration", "1") == 0
    assert record("--policy", "no-motion", "--drives", "1", "--duration", "1") == 2
    assert "holds drives of another controller" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), "nothing to drive"),
        (("--drives", "-1"), "--drives must not be negative"),
        (("--drives", "1", "--policy", "classical", "--objective", "perceived"), "--objective perceived"),
        (("--drives", "1", "--policy", "learned-preview"), "an agent sees"),
        (("--drives", "1", "--policy", "clasical"), "Did you mean"),
        (("--maneuvers", "no-such-drive"), "unknown maneuver"),
    ],
)
def test_wrong_arguments_are_refused(folder, capsys, words, told):
    assert record(*words) == 2
    assert told in capsys.readouterr().err
    assert not folder.exists()


def test_another_ones_index_is_not_replaced(folder, capsys):
    folder.mkdir()
    (folder / "index.json").write_text("hello")
    assert record(*WASHOUT, "--drives", "1") == 2
    assert "not JSON" in capsys.readouterr().err
    assert (folder / "index.json").read_text() == "hello"


def test_broken_recordings_are_refused(folder):
    assert record(*WASHOUT, "--drives", "1", "--duration", "1") == 0
    (entry,) = load_index(folder).drives
    path = folder / entry.file
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(DataError, match="missing or damaged"):
        list(load_demonstrations(folder))
    index = json.loads((folder / "index.json").read_text())
    for damaged, told in [
        ("{", "not JSON"),
        (json.dumps(index | {"format": 1}), "format 2"),
        (json.dumps({"format": 2}), "missing or unknown"),
        (json.dumps(index | {"drives": [{"name": "x"}]}), "missing or unknown"),
    ]:
        (folder / "index.json").write_text(damaged)
        with pytest.raises(DataError, match=told):
            load_index(folder)
    with pytest.raises(DataError, match="cannot be read"):
        load_index(folder / "nowhere")


def test_a_demonstration_of_wrong_shape_is_refused():
    columns = {"observation": 52, "action": 9, "force": 3, "rate": 3, "position": 9, "velocity": 9}
    arrays = {name: np.zeros((5, size)) for name, size in columns.items()}
    assert len(Demonstration("fine", time=np.arange(5.0), **arrays)) == 5
    for name in columns:
        with pytest.raises(DataError, match=f"{name} must be finite"):
            Demonstration("broken", time=np.arange(5.0), **(arrays | {name: np.zeros((5, 2))}))
    with pytest.raises(DataError, match="action must be finite"):
        Demonstration("broken", time=np.arange(5.0), **(arrays | {"action": np.full((5, 9), np.nan)}))
