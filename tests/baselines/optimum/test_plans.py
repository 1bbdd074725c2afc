"""Plans: as good as they claim, within every limit, and better than others."""

from __future__ import annotations

import os
import signal
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.baselines import ClassicalWashout, make_policy
from motion_cueing.baselines.optimum import Optimum, OptimumOptions
from motion_cueing.baselines.optimum.windows import Planner, WindowProgram, windows
from motion_cueing.baselines.symbolic import SymbolicMachine
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.perception import get_vestibular_model
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.simulator.kernels.observation import OBSERVATION_SIZE
from motion_cueing.envs.simulator.simulator import Simulator
from motion_cueing.evaluation import measure, rollout

from .drives import DT, gentle, hard_braking, surge, turning, weaving

pytestmark = pytest.mark.slow

COARSE = OptimumOptions(steps=5, effort=1e-3)
"""One set of options for most tests: the program of a machine is made once for them all."""


def test_a_surge_within_the_travel_is_felt_as_it_is():
    """Carriage and hexapod together move as the car does, less its speed: the integral is known."""
    drive = surge(3.0, 2.0)
    record = rollout(Optimum(options=COARSE), drive)
    assert measure(record).cue_error < 1e-4
    omega = 2.0 * np.pi / 3.0
    traveled = 2.0 / omega * (record.time - np.sin(omega * record.time) / omega)
    assert np.abs(record.carriage[:, 0] + record.hexapod[:, 0] - traveled).max() < 0.05


def test_the_plan_gives_what_it_claims_and_meets_no_limit(braking):
    _, plan, record = braking
    found, account = measure(record), plan.report
    assert account.braked == account.unconverged == 0
    assert found.cue_error == pytest.approx(account.claimed, rel=1e-9)
    assert found.cue_error == pytest.approx(account.played, rel=1e-9)
    assert not record.limits_active.any()
    assert found.clipped == 0.0
    assert float(record.metadata["optimum_claimed"]) == account.claimed


def test_the_limits_are_used(braking):
    assert 0.6 < np.abs(braking[2].legs).max() < 0.67


def test_a_plan_that_comes_near_a_singular_pose_is_made_anew_clear_of_it():
    """Without a turntable the hexapod yaws for as long as its legs, longer here, let it."""
    drive, machine = turning(6.0, 0.3), get_platform("paper-no-turntable")
    machine = replace(machine, hexapod=replace(machine.hexapod, extension=(-0.67, 1.2)))
    record = rollout(
        Optimum(machine, options=replace(COARSE, steps=20), cached=False), drive, platform=machine
    )
    account = {key: int(record.metadata[f"optimum_{key}"]) for key in ("widened", "unconverged", "braked")}
    assert account == {"widened": 1, "unconverged": 0, "braked": 0}
    assert not record.limits_active.any()
    assert measure(record).cue_error == pytest.approx(float(record.metadata["optimum_claimed"]), rel=1e-6)
    poses = np.hstack([np.zeros((len(record.time), 2)), record.hexapod, np.zeros((len(record.time), 1))])
    clearance = np.array(SymbolicMachine(machine).clearance(poses.T))
    assert 0.15 < clearance.min() < 0.3


def costs_with(drive: CueTrace, accelerations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) sums of squared errors of n plans (n, steps, 9), and whether each keeps all limits."""
    simulator = Simulator(get_platform("paper"), drive, drive_of=np.zeros(len(accelerations), dtype=int))
    simulator.reset()
    costs, kept = np.zeros(len(accelerations)), np.ones(len(accelerations), dtype=bool)
    for k in range(accelerations.shape[1]):
        state = simulator.step(accelerations[:, k])
        force = (state["simulator_cue"]["force"] - state["reference_cue"]["force"]) / 0.6
        rate = (state["simulator_cue"]["rate"] - state["reference_cue"]["rate"]) / np.radians(3.0)
        costs += np.sum(force**2, axis=1) + np.sum(rate**2, axis=1)
        kept &= state["limits"] == 0
    return costs, kept


def test_no_short_detour_within_the_limits_is_better(braking):
    """Detours of a second that come back to the plan, of any axis, at any time, to either side."""
    drive, plan, _ = braking
    steps, length = len(plan.accelerations), 100
    phase = 2.0 * np.pi * np.arange(length) / length
    detour = 0.02 * np.sin(phase) * (1.0 - np.cos(phase))  # its integral, and that one's, are zero
    detour -= detour.mean()
    detours = [np.zeros((steps, 9))]
    for axis in range(9):
        for first in range(0, steps - length, 10):
            for side in (-1.0, 1.0):
                detours.append(np.zeros((steps, 9)))
                detours[-1][first : first + length, axis] = side * detour
    costs, kept = costs_with(drive, plan.accelerations + np.array(detours))
    assert kept[0]
    assert np.count_nonzero(kept) > 50
    assert costs[kept].min() > 0.9995 * costs[0]


def test_a_finer_grid_and_longer_legs_are_better(braking):
    drive, plan, _ = braking
    coarser = Optimum(options=replace(COARSE, steps=10)).plan(drive).report
    assert plan.report.played < coarser.played
    paper = get_platform("paper")
    longer = replace(paper, hexapod=replace(paper.hexapod, extension=(-0.8, 0.8)))
    assert Optimum(longer, COARSE).plan(drive).report.played < 0.99 * plan.report.played


def test_it_is_better_than_the_washout():
    drive = weaving(3.0)
    washout = measure(rollout(ClassicalWashout("classical"), drive)).cue_error
    assert measure(rollout(Optimum(options=COARSE), drive)).cue_error < 0.1 * washout


def test_the_perceived_optimum_gives_what_it_claims_and_is_perceived_better():
    drive = hard_braking(1.5, 9.0)
    perceived = Optimum(options=OptimumOptions(objective="perceived"))
    record = rollout(perceived, drive)
    found = measure(record)
    assert float(record.metadata["optimum_claimed"]) == pytest.approx(found.perceived_cue_error, rel=0.02)
    assert not record.limits_active.any()
    other = measure(rollout(Optimum(options=COARSE), drive))
    assert found.perceived_cue_error < other.perceived_cue_error
    assert found.cue_error > other.cue_error


def test_windows_agree_with_the_whole():
    drive = gentle(4.0)
    whole = Optimum(options=COARSE).plan(drive).report
    parts = Optimum(options=replace(COARSE, window=2.5, keep=1.0)).plan(drive).report
    assert (whole.windows, parts.windows) == (1, 3)
    assert parts.claimed == pytest.approx(parts.played, rel=1e-6)
    assert parts.played == pytest.approx(whole.played, abs=0.002)


def test_windows_of_what_is_perceived_know_what_was_felt_before():
    """A filter that forgot its past at a window's start would claim something else than what is played."""
    options = OptimumOptions(objective="perceived", window=1.0, keep=0.7)
    account = Optimum(options=options).plan(hard_braking(1.5, 9.0)).report
    assert account.windows == 2
    assert account.played > 0.01
    assert account.claimed == pytest.approx(account.played, rel=0.01)


@given(
    steps=st.integers(1, 5000),
    node=st.integers(1, 10),
    window=st.floats(0.5, 30.0),
    share=st.floats(0.1, 1.0),
)
def test_windows_cover_every_step_once_and_begin_at_nodes(steps, node, window, share):
    options = OptimumOptions(steps=node, window=window, keep=share * window)
    cut = list(windows(steps, options, DT))
    assert [part.first for part in cut] == [0, *(part.applied for part in cut[:-1])]
    assert cut[-1].applied == cut[-1].last == steps
    assert all(part.first % node == 0 and part.first < part.applied <= part.last for part in cut)


@pytest.mark.parametrize("name", ["24-inch", "dim-hexapod", "nads-1"])
def test_other_machines_keep_their_limits_and_missing_subsystems_stand_still(name):
    platform = get_platform(name)
    record = rollout(Optimum(platform, COARSE), weaving(1.5, seed=3), platform)
    assert record.metadata["optimum_braked"] == "0"
    assert not record.limits_active.any()
    assert (np.abs(record.carriage).max() > 1e-9) == (platform.carriage is not None)
    assert (np.abs(record.turntable).max() > 1e-9) == (platform.turntable is not None)


def test_a_machine_that_begins_elsewhere_gets_its_own_plan():
    drive = surge(1.0, 1.0)
    start = np.array([3.0, -2.0, 0.1, 0.0, 0.0, 0.05, 0.0, 0.1, 0.4])
    record = rollout(Optimum(options=COARSE), drive, start=start)
    assert float(record.metadata["optimum_played"]) == pytest.approx(measure(record).cue_error, rel=1e-6)
    assert not record.limits_active.any()


def test_a_solve_cut_short_is_counted_and_keeps_the_limits():
    options = replace(COARSE, iterations=2, widenings=0)
    record = rollout(Optimum(options=options), hard_braking(2.0))
    assert record.metadata["optimum_unconverged"] == "1"
    assert not record.limits_active.any()


def test_without_a_plan_that_keeps_the_limits_the_machine_brakes_to_a_stop(monkeypatch):
    solve, asked = WindowProgram.solve, []

    def spoilt(self, wanted, start):
        solution = solve(self, wanted, start)
        asked.append(self.margin)
        return solution if len(asked) == 1 else replace(solution, accelerations=50.0 + solution.accelerations)

    monkeypatch.setattr(WindowProgram, "solve", spoilt)
    options = replace(COARSE, window=2.0, keep=1.0, widenings=1)
    record = rollout(Optimum(options=options, cached=False), surge(3.0, 3.0))
    notes = record.metadata
    assert (notes["optimum_windows"], notes["optimum_braked"], notes["optimum_widened"]) == ("2", "1", "1")
    assert asked == [0.01, 0.01, 0.03]
    assert not record.limits_active.any()
    moving = np.hstack([record.carriage_rate, record.hexapod_rate])
    assert np.abs(moving[100]).max() > 0.3
    assert np.abs(moving[-1]).max() < 1e-6


def test_a_plan_that_is_not_finite_is_no_plan(monkeypatch):
    solve = WindowProgram.solve

    def spoilt(self, wanted, start):
        solution = solve(self, wanted, start)
        return replace(solution, accelerations=np.nan * solution.accelerations, converged=False)

    monkeypatch.setattr(WindowProgram, "solve", spoilt)
    plan = Optimum(options=replace(COARSE, widenings=0), cached=False).plan(surge(1.0, 1.0))
    assert plan.report.braked == plan.report.unconverged == 1
    assert not plan.accelerations.any()


def test_ctrl_c_ends_a_solve():
    heard = []

    def tell(share: float, iterations: int) -> None:
        heard.append(iterations)
        if iterations == 2:
            os.kill(os.getpid(), signal.SIGINT)

    arguments = (
        get_platform("paper"),
        COARSE,
        get_vestibular_model("zacharias"),
        hard_braking(2.0),
        np.zeros(9),
    )
    # A shell's background jobs begin with Ctrl-C ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            Planner(*arguments, tell).plan()
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard == [1, 2]


def test_the_registry_knows_both():
    platform = get_platform("nads-1")
    for name in ("optimum", "optimum-perceived"):
        policy = make_policy(name, platform)
        assert policy.name == name
        assert policy.platform == platform


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"keep": 70.0}, "keep = 70 s must not be longer than window = 60 s"),
        ({"steps": 0}, "'steps'"),
        ({"objective": "comfort"}, "'objective'"),
        ({"margins": 0.1}, "margin"),
        ({"effort": -1.0}, "'effort'"),
    ],
)
def test_wrong_options_are_refused(fields, words):
    with pytest.raises(ConfigurationError, match=words):
        OptimumOptions(**fields)


def test_wrong_input_is_refused():
    with pytest.raises(ConfigurationError, match="cues must be a CueTrace"):
        Optimum().for_drive(np.zeros((10, 3)))
    policy = Optimum(options=COARSE).for_drive(surge(0.5, 0.5))
    with pytest.raises(ConfigurationError, match="one machine"):
        policy.predict(np.zeros((2, OBSERVATION_SIZE)))


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"observation": np.full(OBSERVATION_SIZE, np.nan)}, "observation is not finite"),
        ({"observation": np.zeros((1, 5))}, "observation has shape"),
        ({"state": "begin"}, "state is of type str; give what the last call"),
        ({"state": -1}, "state is of type int; give what the last call"),
        ({"episode_start": np.zeros(3, dtype=bool)}, "episode_start is an array of bool"),
    ],
)
def test_wrong_arguments_are_named(arguments, told):
    policy = Optimum(options=COARSE).for_drive(surge(0.5, 0.5))
    good = {"observation": np.zeros(OBSERVATION_SIZE), "state": 3}
    with pytest.raises(DataError, match=told):
        policy.predict(**(good | arguments))


def test_a_drive_of_two_samples_has_a_plan():
    drive = CueTrace("short", [0.0, DT], np.tile([0.0, 0.0, -9.81], (2, 1)), np.zeros((2, 3)))
    assert Optimum(options=COARSE).plan(drive).accelerations.shape == (1, 9)
