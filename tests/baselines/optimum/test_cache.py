"""Plans kept: found again to the bit, never in place of another, and made anew where damaged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.baselines.optimum import Optimum, OptimumOptions
from motion_cueing.baselines.optimum.plan import Plan, PlanReport, key_of, load_plan, plans_folder, store_plan
from motion_cueing.baselines.optimum.windows import Planner
from motion_cueing.envs.perception import get_vestibular_model
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.storage import cache_folder

from .drives import surge

OPTIONS = OptimumOptions(effort=1e-3)
ACCOUNT = PlanReport("J", 0.1, 0.1, 1, 10, 0, 0, 0, 1.5)


@pytest.fixture
def plan() -> Plan:
    return Plan(np.random.default_rng(0).normal(size=(20, 9)), np.zeros(9), ACCOUNT)


def test_a_plan_is_made_once(monkeypatch):
    drive, optimum = surge(1.0, 1.0), Optimum(options=OPTIONS)
    first = optimum.plan(drive)
    assert len(list(plans_folder().iterdir())) == 1

    def refuse(self):
        raise AssertionError("solved again")

    monkeypatch.setattr(Planner, "plan", refuse)
    again = Optimum(options=OPTIONS).plan(drive)
    assert np.array_equal(again.accelerations, first.accelerations)
    assert again.report == first.report
    with pytest.raises(AssertionError, match="solved again"):
        Optimum(options=OPTIONS, cached=False).plan(drive)


@pytest.mark.parametrize("damage", [b"", b"not a plan", None], ids=["empty", "foreign", "one byte"])
def test_a_damaged_file_is_no_plan(plan, damage):
    store_plan("key", plan)
    path = plans_folder() / "key.npz"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(bytes(content) if damage is None else damage)
    assert load_plan("key", 20) is None


def test_every_cut_of_a_file_is_no_plan(plan):
    store_plan("key", plan)
    path = plans_folder() / "key.npz"
    content = path.read_bytes()
    for length in range(0, len(content), 97):
        path.write_bytes(content[:length])
        assert load_plan("key", 20) is None


def test_a_plan_of_another_length_is_not_taken(plan):
    store_plan("key", plan)
    assert load_plan("key", 21) is None
    assert np.array_equal(load_plan("key", 20).accelerations, plan.accelerations)


def test_a_damaged_plan_is_made_anew():
    drive, optimum = surge(0.5, 1.0), Optimum(options=OPTIONS)
    first = optimum.plan(drive)
    (path,) = plans_folder().iterdir()
    path.write_bytes(b"PK")
    assert np.array_equal(optimum.plan(drive).accelerations, first.accelerations)
    assert path.stat().st_size > 1000


def test_a_folder_that_cannot_be_written_is_no_error(plan, tmp_path, monkeypatch):
    (tmp_path / "optimum").write_text("in the way")
    monkeypatch.setenv("MOTION_CUEING_CACHE", str(tmp_path))
    store_plan("key", plan)
    assert load_plan("key", 20) is None


def test_whatever_a_plan_follows_from_is_in_its_key():
    drive, machine, model = surge(1.0, 1.0), get_platform("paper"), get_vestibular_model("zacharias")
    rest = np.zeros(9)
    given = (machine, OPTIONS, model, drive, rest)
    force, rate, acceleration = (
        np.array(values)
        for values in (drive.specific_force, drive.angular_velocity, drive.angular_acceleration)
    )
    for values in (force, rate, acceleration):
        values[3, 1] += 1e-12
    slower = replace(drive, time=1.5 * drive.time, angular_acceleration=np.array(drive.angular_acceleration))
    others = [
        (machine.without_turntable(), OPTIONS, model, drive, rest),
        (machine, replace(OPTIONS, margin=0.02), model, drive, rest),
        (machine, replace(OPTIONS, objective="perceived"), model, drive, rest),
        (machine, OPTIONS, get_vestibular_model("telban"), drive, rest),
        (machine, OPTIONS, model, replace(drive, specific_force=force), rest),
        (machine, OPTIONS, model, replace(drive, angular_velocity=rate), rest),
        (machine, OPTIONS, model, replace(drive, angular_acceleration=acceleration), rest),
        (machine, OPTIONS, model, slower, rest),
        (machine, OPTIONS, model, drive, rest + 1e-9),
    ]
    assert len({key_of(*arguments) for arguments in (given, *others)}) == 10
    renamed = (replace(machine, name="mine"), OPTIONS, model, replace(drive, name="other"), rest)
    assert key_of(*renamed) == key_of(*given)


def test_the_folder_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.delenv("MOTION_CUEING_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "motion-cueing"
    assert plans_folder() == tmp_path / "motion-cueing" / "optimum"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_folder() == tmp_path / "home" / ".cache" / "motion-cueing"
    monkeypatch.setenv("MOTION_CUEING_CACHE", str(tmp_path / "mine"))
    assert (cache_folder(), plans_folder()) == (tmp_path / "mine", tmp_path / "mine" / "optimum")
