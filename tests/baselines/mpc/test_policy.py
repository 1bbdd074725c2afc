"""Predictive controllers in drives."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

from motion_cueing.baselines import make_policy, policy_names, symbolic
from motion_cueing.baselines.mpc import MpcParameters, TiltRate, make_mpc
from motion_cueing.baselines.mpc import solver as solver_module
from motion_cueing.baselines.mpc.policy import Brakes
from motion_cueing.baselines.mpc.prediction import make_grid
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import save
from motion_cueing.envs.simulator.kernels.observation import OBSERVATION_SIZE
from motion_cueing.envs.simulator.simulator import TIME_STEP, Simulator
from motion_cueing.evaluation import measure, rollout
from motion_cueing.evaluation.trajectory import Trajectory

from .machines import NODES, PAPER, quick

pytestmark = pytest.mark.slow


def part(name: str, begin: float, seconds: float, fierce: float = 1.0) -> CueTrace:
    """Some seconds of a maneuver, its cues scaled about rest."""
    whole = get_maneuver(name).drive()
    rows = slice(round(begin * 100), round((begin + seconds) * 100))
    force = (whole.specific_force[rows] + [0.0, 0.0, 9.81]) * fierce - [0.0, 0.0, 9.81]
    return CueTrace(name, whole.time[rows], force, fierce * whole.angular_velocity[rows])


SLALOM = part("slalom", 4.0, 2.5)


@cache
def driven(cues: CueTrace, platform=PAPER, **fields: object) -> Trajectory:
    """The drive of a small controller; tests share those that they have in common."""
    return rollout(make_mpc(platform, quick(**fields)), cues, platform)


def test_fierce_drives_meet_no_limit():
    trajectory = driven(part("slalom", 5.0, 4.0, fierce=2.0), preview=1.0, every=1)
    assert not np.any(trajectory.limits_active)
    assert trajectory.metadata["mpc_failures"] == "0"
    assert np.abs(trajectory.carriage_rate).max() > 3.0  # it was a fierce drive


@pytest.mark.parametrize("name", ["dim-hexapod", "24-inch"])
def test_small_machines_keep_their_limits(name):
    platform = get_platform(name)
    trajectory = driven(SLALOM, platform, preview=1.0)
    assert not np.any(trajectory.limits_active)
    assert not np.any(trajectory.action[:, :2])
    assert np.abs(trajectory.hexapod).max() > 0.01


def test_what_is_known_ahead_helps():
    ignorant, told, whole = (
        measure(driven(SLALOM, preview=p)).cue_error for p in (0.0, 1.0, quick().horizon)
    )
    still = measure(rollout(make_policy("no-motion", PAPER), SLALOM, PAPER)).cue_error
    assert whole < told < ignorant < still
    assert told < 0.05 * still


def test_the_same_drive_gives_the_same_motion():
    first, second = driven(SLALOM, preview=1.0), rollout(make_mpc(PAPER, quick(preview=1.0)), SLALOM, PAPER)
    assert np.array_equal(first.action, second.action)
    assert first.metadata["mpc_solves"] == second.metadata["mpc_solves"] == str(len(SLALOM) // 2)


def test_between_solutions_the_plan_is_followed():
    policy = make_mpc(PAPER, quick(every=5))
    row = np.random.default_rng(1).normal(size=OBSERVATION_SIZE) * 0.05
    first, state = policy.predict(row)
    plan = state[0].plan
    for age in range(1, 5):
        action, state = policy.predict(row, state)
        middle = np.array([TIME_STEP * (age + 0.5)])
        assert np.array_equal(action, make_grid(NODES).at(plan, middle)[0])
        assert np.abs(action - first).max() > 1e-3
    _, state = policy.predict(row, state)
    assert not np.array_equal(state[0].plan, plan)
    # A plan that is followed for 50 ms is worth about as much as a new one each 20 ms.
    often, seldom = (measure(driven(SLALOM, preview=1.0, **every)).cue_error for every in ({}, {"every": 5}))
    assert seldom == pytest.approx(often, rel=0.3)


@pytest.mark.parametrize("preview", [0.0, 1.0])
def test_another_time_step_is_refused(preview):
    with pytest.raises(ConfigurationError, match=r"time step is 0\.01 s, the rollout's 0\.02 s"):
        rollout(make_mpc(PAPER, quick(preview=preview)), SLALOM, PAPER, dt=0.02)


ROW = np.zeros(OBSERVATION_SIZE)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"observation": np.zeros((1, 5))}, r"observation has shape \(1, 5\), expected \(n, 52\)"),
        ({"observation": np.full(OBSERVATION_SIZE, np.nan)}, "observation is not finite"),
        ({"observation": ["fast"]}, "observation is not numeric"),
        ({"state": "begin"}, "state is of type str; give what the last call for these 1 observations"),
        ({"state": []}, "state is of type list; give what the last call"),
        ({"state": [3]}, "state is of type list; give what the last call"),
        ({"episode_start": np.zeros(2, dtype=bool)}, "episode_start is an array of bool"),
        ({"episode_start": 1}, "give 1 booleans, one an observation"),
    ],
)
def test_wrong_arguments_are_named(arguments, told):
    policy = make_mpc(PAPER, quick())
    with pytest.raises(DataError, match=told):
        policy.predict(**({"observation": ROW} | arguments))


def test_a_batch_is_as_many_machines_by_themselves():
    policy = make_mpc(PAPER, quick())
    rows = np.random.default_rng(0).normal(size=(3, OBSERVATION_SIZE)) * 0.05
    together, memory = policy.predict(rows)
    assert together.shape == (3, 9)
    for i in range(3):
        alone, _ = policy.predict(rows[i])
        assert np.array_equal(alone, together[i])
    later, _ = policy.predict(rows, memory, np.array([True, False, True]))
    assert np.array_equal(later[0], together[0])
    assert np.array_equal(later[2], together[2])


def test_the_turntable_goes_round_and_round():
    n = 1200
    yaw = np.column_stack([np.zeros((n, 2)), np.full(n, 0.6)])
    cues = CueTrace("merry-go-round", 0.01 * np.arange(n), np.tile([0.0, 0.0, -9.81], (n, 1)), yaw)
    trajectory = driven(cues, preview=1.0, every=10)
    assert trajectory.turntable[-1] > 2.0 * np.pi
    assert np.abs(np.diff(trajectory.turntable_rate[300:])).max() < 0.01
    assert trajectory.w_simulator[-1, 2] == pytest.approx(0.6, abs=0.02)


def test_no_plan_means_braking_to_a_stop_within_limits(monkeypatch):
    real = solver_module.solve
    calls = []

    def failing(*arguments):
        calls.append(1)
        return replace(real(*arguments), solved=len(calls) <= 100)

    monkeypatch.setattr("motion_cueing.baselines.mpc.solver.solve", failing)
    trajectory = driven(part("slalom", 5.0, 3.0, fierce=1.5), preview=1.0)
    assert trajectory.metadata["mpc_failures"] == str(len(calls) - 100)
    assert len(calls) > 150
    assert not np.any(trajectory.limits_active)
    moving = np.abs(trajectory.carriage_rate).max(axis=1)
    assert moving[200] > 0.3
    for rates in (trajectory.carriage_rate, trajectory.legs_rate, trajectory.turntable_rate):
        assert np.abs(rates[-1]).max() < 1e-6


def test_brakes_stop_every_actuator_without_meeting_a_limit():
    rng = np.random.default_rng(8)
    still = CueTrace("still", 0.01 * np.arange(9), np.tile([0.0, 0.0, -9.81], (9, 1)), np.zeros((9, 3)))
    simulator = Simulator(PAPER, still)
    simulator.reset()
    for _ in range(30):
        simulator.step(rng.normal(size=9) + np.array([3.0, -3.0, 1.0, 1.0, 0.5, 0.5, -0.5, 0.5, 1.0]))
    brakes = Brakes(PAPER)
    for _ in range(200):
        motion = simulator.state[0]["motion"]
        q = np.concatenate(
            [motion["position"][:2], motion["displacement"], motion["beta"], motion["position"][8:]]
        )
        v = np.concatenate([motion["rate"][:2], motion["velocity"], motion["beta_rate"], motion["rate"][8:]])
        simulator.step(brakes(q, v))
        assert simulator.state[0]["limits"] == 0
    assert np.abs(simulator.state[0]["motion"]["rate"]).max() < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_brakes_stay_finite_where_the_legs_cannot_turn_the_platform(seed):
    """Turned by about 90 degrees, the hexapod is singular: its legs have no hold on one motion."""
    brakes, rng = Brakes(PAPER), np.random.default_rng(seed)
    offset = rng.uniform(-0.05, 0.05, 9)

    def pose(yaw: float) -> np.ndarray:
        return offset + yaw * np.eye(9)[7]

    def determinant(yaw: float) -> float:
        slope = np.asarray(brakes._after(pose(yaw), np.zeros(9), np.zeros(9))[1]) / TIME_STEP
        return float(np.linalg.det(slope))

    singular = brentq(determinant, 1.2, 1.9, xtol=1e-15)
    assert abs(determinant(singular)) < 1e-9 * determinant(0.0)
    action = brakes(pose(singular), 0.1 * rng.normal(size=9))
    assert np.abs(action).max() < 100.0


def test_tilt_rate_is_held_back_where_it_has_a_price():
    braking = part("braking", 2.0, 3.0, fierce=2.0)
    limit = TiltRate().limit
    free = measure(driven(braking)).tilt_rate_peak
    priced = measure(driven(braking, tilt_rate=TiltRate(weight=1000.0))).tilt_rate_peak
    assert priced < 1.3 * limit < 0.5 * free


def test_the_perceived_objective_lowers_the_perceived_error():
    nodes = (*NODES, 2.6, 4.2)
    cab, perceived = (
        measure(driven(part("braking", 2.0, 6.0), preview=4.2, every=4, nodes=nodes, objective=objective))
        for objective in ("cab", "perceived")
    )
    assert perceived.perceived_cue_error < 0.9 * cab.perceived_cue_error


def test_registered_names_make_policies(monkeypatch):
    monkeypatch.setattr(symbolic, "find_compiler", lambda: None)  # machine code changes nothing here
    for name in ("mpc", "mpc-preview", "mpc-full", "nmpc", "nmpc-preview"):
        assert name in policy_names()
        policy = make_policy(name, PAPER)
        assert policy.needs_drive == (name not in ("mpc", "nmpc"))
        assert policy.name == name
    full = make_policy("mpc-full", PAPER).parameters
    assert isinstance(full, MpcParameters)
    assert full.forecast.preview >= full.horizon


@pytest.mark.parametrize("parameters", [quick(preview=0.5), quick(preview=0.5, nonlinear=True)])
def test_parameters_in_a_file_make_a_policy(tmp_path, parameters):
    save(parameters, tmp_path / "mine.yaml")
    policy = make_policy(tmp_path / "mine.yaml", PAPER)
    assert policy.needs_drive
    assert (policy.name, policy.parameters) == ("mine", parameters)
    kind = "nmpc" if parameters.nonlinear else "mpc"
    (tmp_path / "bad.yaml").write_text(f"algorithm: {kind}\nnods: [1.0]\n")
    with pytest.raises(ConfigurationError, match=r"bad.yaml: unknown field 'nods'"):
        make_policy(tmp_path / "bad.yaml", PAPER)
