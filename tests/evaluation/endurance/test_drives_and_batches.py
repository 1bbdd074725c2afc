"""Drives follow from their seeds, and a batch gives each what it would get alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.baselines import make_policy
from motion_cueing.baselines.interface import Machines
from motion_cueing.envs.car import get_car
from motion_cueing.envs.car.vehicles import STANDARD_CARS
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.maneuvers import drive_seeds
from motion_cueing.envs.maneuvers.roads import ORDINARY_KINDS
from motion_cueing.envs.platform.kernels import ActuatorDynamics
from motion_cueing.envs.task import ActionOptions, ObservationOptions, TaskOptions
from motion_cueing.evaluation import measure, rollout
from motion_cueing.evaluation.endurance import NOMINAL, SLOWER, Endurance
from motion_cueing.evaluation.endurance.run import drive_and_check, seeded_drives
from motion_cueing.evaluation.rollout import Rollout

from ...train.agents import agent
from ..studies.bends import PAPER

pytestmark = pytest.mark.slow

SHORT = Endurance(duration=7.0, machines=3)
"""The first three seconds of a drive are straight."""
SEEDS = drive_seeds(5, 1)
CABIN = TaskOptions(
    observation=ObservationOptions(preview=2, memory=(1.0,), frame="cab", true_motion=True),
    action=ActionOptions(repeat=2, frame="cab", authority=0.2),
)


def at_once(policy, cues, platform, machine_of, endurance, condition):
    """A rollout of drives side by side under a condition."""
    machines = Machines(cues, endurance.machines_under(condition, platform), machine_of)
    return Rollout(policy, machines, finite=True)


@pytest.fixture(scope="module")
def drives():
    return seeded_drives(SHORT, SEEDS)


def test_a_drive_is_what_its_seed_says_alone_or_among_others(drives):
    assert drive_seeds(9, 1)[:5] == SEEDS
    for drive in drives[:2]:
        (alone,) = seeded_drives(SHORT, [drive.seed])
        assert (alone.car, alone.friction, alone.machine) == (drive.car, drive.friction, drive.machine)
        assert alone.cues.digest() == drive.cues.digest()
    assert all(0.7 <= drive.friction <= 1.0 for drive in drives)


def test_every_kind_of_road_every_car_and_every_machine_comes():
    endurance, seeds = Endurance(), drive_seeds(300, 0)
    plans = [endurance.drives.plan(seed, 1.0) for seed in seeds[:120]]
    assert {plan.name.rpartition("-")[0] for plan in plans} == set(ORDINARY_KINDS)
    assert {plan.car.name for plan in plans} == set(STANDARD_CARS)
    machines = endurance.machines_under(SLOWER, PAPER)
    assert len(machines) == len(set(map(repr, machines))) == 64
    dynamics = [one for m in machines for one in (m.carriage, m.hexapod, m.turntable)]
    assert all(30.0 <= one.dynamics.natural_frequency <= 90.0 for one in dynamics)
    assert all(0.0 <= one.dynamics.dead_time <= 0.05 for one in dynamics)
    assert endurance.machines_under(NOMINAL, PAPER) == [PAPER]


def test_friction_is_a_factor_on_that_of_the_car(drives):
    slippery = seeded_drives(replace(SHORT, friction=(0.5, 0.5)), SEEDS)
    assert [drive.friction for drive in slippery] == [0.5] * 5
    same = seeded_drives(replace(SHORT, friction=(1.0, 1.0)), SEEDS[:1])[0]
    plan = SHORT.drives.plan(SEEDS[0], 7.0)
    assert plan.car == get_car(same.car)


@pytest.mark.parametrize("fields", [{"dead_time": (0.1, 0.0)}, {"natural_frequency": (60.0, 20.0)}])
def test_ranges_go_from_low_to_high(fields):
    with pytest.raises(ConfigurationError, match="from low to high"):
        Endurance(**fields)


@pytest.mark.parametrize(
    "policy",
    [make_policy("classical", PAPER), agent(CABIN), agent(TaskOptions())],
    ids=["classical", "agent in the cab's frame", "agent"],
)
@pytest.mark.parametrize("condition", [NOMINAL, SLOWER])
def test_a_batch_is_measured_as_single_drives_are(drives, policy, condition):
    machine_of = [0 if condition == NOMINAL else drive.machine for drive in drives]
    cues = [drive.cues for drive in drives]
    found, _ = drive_and_check(at_once(policy, cues, PAPER, machine_of, SHORT, condition), PAPER)
    machines = SHORT.machines_under(condition, PAPER)
    assert len(set(machine_of)) > (condition == SLOWER)
    for k in (0, 1, 4):
        machine = machines[machine_of[k]]
        alone = policy.on(machine) if hasattr(policy, "on") else policy
        metrics = measure(rollout(alone, cues[k], machine))
        assert found[k].samples == len(cues[k])
        # A network may round otherwise for many rows than for one.
        assert found[k].cue_error == pytest.approx(metrics.cue_error, rel=1e-4)
        assert found[k].perceived_cue_error == pytest.approx(metrics.perceived_cue_error, rel=1e-4)
        assert found[k].at_limit == pytest.approx(metrics.at_limit, abs=0.01)


def test_a_washout_is_measured_to_the_last_digit(drives):
    cues, policy = [drive.cues for drive in drives], make_policy("classical", PAPER)
    found, _ = drive_and_check(at_once(policy, cues, PAPER, [0] * 5, SHORT, NOMINAL), PAPER)
    for one, drive in zip(found, cues, strict=True):
        metrics = measure(rollout(policy, drive, PAPER))
        assert one.cue_error == pytest.approx(metrics.cue_error, rel=1e-12)
        assert one.at_limit == metrics.at_limit


class Throttle:
    """As much as there is, now this way, now that."""

    def __init__(self, task=None) -> None:
        self.steps = 0
        if task is not None:
            self.task = task

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        self.steps += 1
        way = np.where(np.arange(9) % 2 == (self.steps // 150) % 2, 1.0, -1.0)
        size = 1.0 if hasattr(self, "task") else 1e3
        return np.tile(size * way, (len(observation), 1)), state


@pytest.mark.parametrize("task", [None, TaskOptions()])
@pytest.mark.parametrize("condition", [NOMINAL, SLOWER])
def test_full_throttle_is_held_back_and_exceeds_nothing(drives, task, condition):
    cues = [drive.cues for drive in drives]
    driver = at_once(Throttle(task), cues, PAPER, [0, 0, 0, 0, 0], SHORT, condition)
    found, nearest = drive_and_check(driver, PAPER)
    for one in found:
        assert one.at_limit > 0.9
        assert one.beyond == sum(one.exceeded.values()) == one.actions_not_finite == 0
    assert 0.9 < nearest["acceleration"] < 1.0 + 1e-6
    assert 0.5 < nearest["rate"] < 1.0 + 1e-6
    assert 0.5 < nearest["position"] < 1.0 + 1e-6


def test_a_machine_with_less_travel_than_its_limiter_thinks_is_found_out(drives):
    """The check knows nothing of the limiter: held against a smaller machine, the same motion fails."""
    smaller = replace(PAPER, carriage=replace(PAPER.carriage, acceleration=0.5 * PAPER.carriage.acceleration))
    cues = [drives[0].cues]
    found, _ = drive_and_check(at_once(Throttle(), cues, PAPER, [0], SHORT, NOMINAL), smaller)
    assert found[0].exceeded["acceleration"] == found[0].beyond > 1
    assert found[0].exceeded["position"] == 0


class Broken:
    """An answer that is no number, now and then, in one drive."""

    def __init__(self) -> None:
        self.steps = 0

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        self.steps += 1
        action = np.zeros((len(observation), 9))
        if self.steps % 10 == 0:
            action[1, :3] = [np.nan, np.inf, 1.0]
        return action, state


def test_actions_that_are_no_numbers_are_counted_and_not_done(drives):
    cues = [drive.cues for drive in drives[:3]]
    found, _ = drive_and_check(at_once(Broken(), cues, PAPER, [0] * 3, SHORT, NOMINAL), PAPER)
    assert [one.actions_not_finite for one in found] == [0, 70, 0]
    assert all(one.beyond == 0 and one.cue_error is not None for one in found)


def test_a_policy_that_knows_its_drive_is_told_each(drives):
    class Knowing:
        def __init__(self) -> None:
            self.drives: list[str] = []

        def for_drive(self, cues: CueTrace):
            self.drives.append(cues.name)
            return make_policy("classical", PAPER)

    knowing, cues = Knowing(), [drive.cues for drive in drives]
    found, _ = drive_and_check(at_once(knowing, cues, PAPER, [0] * 5, SHORT, NOMINAL), PAPER)
    washout = make_policy("classical", PAPER)
    batch, _ = drive_and_check(at_once(washout, cues, PAPER, [0] * 5, SHORT, NOMINAL), PAPER)
    assert knowing.drives == [one.name for one in cues]
    assert found == batch


def test_lag_is_that_of_the_machine(drives):
    """A machine is slower by its own lag: the pool's members differ in what they give."""
    cues = [drives[0].cues] * 3
    policy = make_policy("classical", PAPER)
    found, _ = drive_and_check(at_once(policy, cues, PAPER, [0, 1, 1], SHORT, SLOWER), PAPER)
    assert found[1] == found[2] != found[0]
    assert PAPER.hexapod.dynamics == ActuatorDynamics()
