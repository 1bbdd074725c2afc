"""The optimal washout: the Riccati solution against independent mathematics, the policy against filters."""

from __future__ import annotations

import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import linalg, signal

from motion_cueing.baselines.tuning.objective import WashoutSpace
from motion_cueing.baselines.washout.batch import WashoutBatch
from motion_cueing.baselines.washout.families import load_of
from motion_cueing.baselines.washout.optimal import (
    OptimalParameters,
    OptimalWashout,
    PlaneWeights,
)
from motion_cueing.baselines.washout.optimal.design import (
    ChannelProblem,
    design,
    discrete,
    heave,
    optimal_regulator,
    plane,
    yaw,
)
from motion_cueing.envs import CueTrace
from motion_cueing.envs.errors import ConfigurationError, UnknownNameError
from motion_cueing.envs.perception import get_vestibular_model
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import save
from motion_cueing.evaluation import measure, rollout

from ..drives import DT, boundless, trace
from .memories import memories

pytestmark = pytest.mark.slow

PAPER = get_platform("paper")
START = load_of("optimal", "optimal-washout")
SPACE = WashoutSpace(START)
OPEN = replace(START, force_scale=(1.0,) * 3, rate_scale=(1.0,) * 3)


def problems(p: OptimalParameters) -> dict[str, ChannelProblem]:
    model = get_vestibular_model(p.vestibular)
    bandwidth = p.rate_bandwidth, p.force_bandwidth
    return {
        "surge": plane(p.surge, model.canals, model.otoliths, 1, 1.0, bandwidth),
        "sway": plane(p.sway, model.canals, model.otoliths, 0, -1.0, bandwidth),
        "heave": heave(p.heave, model.otoliths, p.force_bandwidth),
        "yaw": yaw(p.yaw, model.canals, p.rate_bandwidth),
    }


places = st.lists(st.floats(0.0, 1.0), min_size=len(SPACE), max_size=len(SPACE)).map(np.array)


@given(places)
@settings(max_examples=10, deadline=None)
def test_every_place_of_a_search_has_stable_filters(place):
    solved = design(SPACE.decode(place))
    for channel in ("surge", "sway", "heave", "yaw"):
        found = getattr(solved, channel).filter
        assert np.linalg.eigvals(found.a).real.max() < 0.0
        assert np.abs(np.linalg.eigvals(discrete(found, DT).a)).max() < 1.0


@pytest.mark.parametrize("vestibular", ["telban", "zacharias"])
@pytest.mark.parametrize("channel", ["surge", "sway", "heave", "yaw"])
def test_the_solution_of_the_riccati_equation(channel, vestibular):
    problem = problems(replace(OPEN, vestibular=vestibular))[channel]
    a, b, c = problem.joint
    q = np.diag(problem.q)
    r, s = problem.d.T @ q @ problem.d, c.T @ q @ problem.d
    solved = optimal_regulator(problem)
    p, k = solved.riccati, solved.gain
    terms = (a.T @ p, p @ a, c.T @ q @ c, (p @ b + s) @ np.linalg.solve(r, b.T @ p + s.T))
    residual = terms[0] + terms[1] + terms[2] - terms[3]
    assert np.abs(residual).max() < 1e-9 * max(np.abs(term).max() for term in terms)
    np.testing.assert_allclose(p, p.T, atol=1e-9 * np.abs(p).max())
    assert np.linalg.eigvalsh(p).min() > -1e-9 * np.abs(p).max()

    # The mean cost under white noise in w: trace(P W), and by the covariance of the closed loop.
    noise = np.zeros_like(a)
    noise[-len(problem.bandwidth) :, -len(problem.bandwidth) :] = np.eye(len(problem.bandwidth))
    mean = lyapunov_cost(problem, k, noise)
    assert mean == pytest.approx(np.trace(p @ noise), rel=1e-6)
    # No other gain is better: more and less of each input's share of the car's motion.
    for factor in (0.9, 1.1):
        other = k.copy()
        other[:, -len(problem.bandwidth) :] *= factor
        assert lyapunov_cost(problem, other, noise) > mean
        assert lyapunov_cost(problem, factor * k, noise) > mean


def lyapunov_cost(problem: ChannelProblem, gain: np.ndarray, noise: np.ndarray) -> float:
    """Mean of y'Qy with u = -gain [z, w]: the covariance of the loop solves a Lyapunov equation."""
    a, b, c = problem.joint
    covariance = linalg.solve_continuous_lyapunov(a - b @ gain, -noise)
    y = c - problem.d @ gain
    return float(np.trace(np.diag(problem.q) @ y @ covariance @ y.T))


def test_the_problem_is_perception_of_car_less_machine():
    """Its outputs against the published transfer functions, for a machine that moves at one frequency."""
    model = get_vestibular_model("telban")
    problem = problems(OPEN)["surge"]
    s, rate, force = 2.0j, 0.3, 1.1
    tilt_acceleration, acceleration = 0.2 - 0.1j, 0.7 + 0.4j
    u, w = np.array([tilt_acceleration, acceleration]), np.array([rate, force])
    z = np.linalg.solve(s * np.eye(10) - problem.a, problem.b @ u + problem.e @ w)
    y = problem.c @ z + problem.d @ u + problem.h @ w

    def perceived(transfer, value):
        return np.polyval(transfer[0], s) / np.polyval(transfer[1], s) * value

    tilt_rate, tilt = tilt_acceleration / s, tilt_acceleration / s**2
    expected = [
        perceived(model.canals.transfer_function(1), rate - tilt_rate),
        perceived(model.otoliths.transfer_function(), force - acceleration - 9.81 * tilt),
        acceleration / s**3, acceleration / s**2, acceleration / s,
        tilt_rate, tilt_acceleration, acceleration,
    ]  # fmt: skip
    np.testing.assert_allclose(y, expected, rtol=1e-9)


SMALL = 1e-5
"""m/s^2, rad/s: so small that turning and tilting are linear to one part in a million."""
OMEGA = 2.0 * np.pi
"""rad/s; a whole number of samples is a period."""
TIME = np.arange(3001) * DT


@cache
def driven(channel: int) -> np.ndarray:
    """Memories of the policy in a sine of one channel."""
    cues = np.zeros((len(TIME), 6))
    cues[:, 2] = -9.81
    cues[:, channel] += SMALL * np.sin(OMEGA * TIME)
    drive = CueTrace("sine", TIME, cues[:, :3], cues[:, 3:])
    return memories(OptimalWashout(OPEN, boundless().cab), drive, boundless())["frame"]


def respond(channel: int, of: str, where: int) -> complex:
    """Modulus and phase of an acceleration of the running policy, for a sine of the car's motion.

    Args:
        channel: 0 to 2 specific force x, y, z; 3 to 5 angular velocity.
        of: "cab" for the cab's acceleration in F_I, or the field of the memory that holds an angle's rate.
        where: Its axis.
    """
    frame = driven(channel)
    if of == "cab":
        # The reference point stands above the hexapod's: v + omega x OP.
        omega = np.column_stack([frame["tilt_rate"], frame["beta_hp_rate"][:, 2]])
        rate = (frame["velocity"] + np.cross(omega, boundless().cab.reference_point))[:, where]
    else:
        rate = frame[of][:, where]
    # Acceleration k acts from sample k on; the last period, when what began the drive has gone.
    late = slice(-101, None)
    acceleration = np.diff(rate[late]) / DT
    phase = np.exp(-1j * OMEGA * TIME[1:][late][:-1])
    return complex(2.0j * np.mean(acceleration * phase) / SMALL)


CASES = [
    (0, "cab", 0, "surge", 1, 1),
    (0, "tilt_rate", 1, "surge", 0, 1),
    (4, "tilt_rate", 1, "surge", 0, 0),
    (1, "cab", 1, "sway", 1, 1),
    (1, "tilt_rate", 0, "sway", 0, 1),
    (2, "cab", 2, "heave", 0, 0),
    (5, "beta_hp_rate", 2, "yaw", 0, 0),
]
MOVES = {
    "surge": ((6, 7, 1), (8, 9, 0)),
    "sway": ((6, 7, 1), (8, 9, 0)),
    "heave": ((3, 4, 0),),
    "yaw": ((3, 4, 0),),
}
"""Position, velocity and acceleration: indices of states and of the output that moves them."""


def sampled(channel: str) -> tuple[np.ndarray, ...]:
    """The filter as it runs: the machine under it moves with constant acceleration within a step."""
    f = discrete(getattr(design(OPEN), channel).filter, DT)
    a, b = f.a.copy(), f.b.copy()
    for x, v, u in MOVES[channel]:
        unit = np.eye(len(a))
        a[v], b[v] = unit[v] + DT * f.c[u], DT * f.d[u]
        a[x], b[x] = unit[x] + DT * unit[v] + 0.5 * DT**2 * f.c[u], 0.5 * DT**2 * f.d[u]
    return a, b, f.c, f.d


def response(system: tuple[np.ndarray, ...], z: complex) -> np.ndarray:
    """C (z - A)^-1 B + D; scipy.signal.dfreqresp goes by polynomials, too coarse with poles so near 1."""
    a, b, c, d = system
    return c @ np.linalg.solve(z * np.eye(len(a)) - a, b) + d


@pytest.mark.parametrize(("channel", "of", "where", "filter_", "output", "input_"), CASES)
def test_the_running_policy_has_the_frequency_response_of_its_filter(
    channel, of, where, filter_, output, input_
):
    expected = response(sampled(filter_), np.exp(1j * OMEGA * DT))[output, input_]
    assert respond(channel, of, where) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("channel", "of", "where", "filter_", "output", "input_"), CASES)
def test_the_running_policy_is_the_designed_filter_but_for_the_time_step(
    channel, of, where, filter_, output, input_
):
    """Against scipy.signal.freqresp of the continuous filter, at 1 Hz and 100 steps a second."""
    f = getattr(design(OPEN), filter_).filter
    single = f.a, f.b[:, [input_]], f.c[[output]], f.d[[output]][:, [input_]]
    _, expected = signal.freqresp(single, w=[OMEGA])
    assert respond(channel, of, where) == pytest.approx(expected[0], rel=OMEGA * DT)


@pytest.mark.parametrize("channel", ["surge", "sway", "heave", "yaw"])
def test_the_sampled_filter_comes_nearer_to_the_design_with_the_time_step(channel):
    f = getattr(design(OPEN), channel).filter
    single = f.a, f.b[:, [0]], f.c[[0]], f.d[[0]][:, [0]]
    _, exact = signal.freqresp(single, w=[2.0])
    errors = []
    for dt in (1e-4, 1e-5):
        s = discrete(f, dt)
        found = response((s.a, s.b, s.c, s.d), np.exp(2.0j * dt))[0, 0]
        errors.append(abs(found - exact[0]) / abs(exact[0]))
    assert errors[0] < 1e-3
    assert errors[1] < 0.11 * errors[0] + 1e-7


def test_no_design_rings_and_none_runs_away_at_the_limits():
    """Loops faster than the time step, noise, and limits met most of the time."""
    rng = np.random.default_rng(1)
    time = np.arange(1501) * DT
    force, rate = 3.0 * rng.standard_normal((len(time), 3)), 0.3 * rng.standard_normal((len(time), 3))
    force[:, 0] += 5.0 * np.sin(1.1 * time)
    force[:, 2] -= 9.81
    drive = CueTrace("noise", time, force, rate)
    corners = [rng.integers(0, 2, len(SPACE)).astype(float) for _ in range(20)]
    sets = [SPACE.decode(place) for place in (*corners, *rng.random((10, len(SPACE))))]
    scores = WashoutBatch(sets, [drive], PAPER).scores()
    assert np.isfinite(scores.cue_error).all()
    assert scores.at_limit.max() > 0.5
    for parameters in sets:
        solved = design(parameters)
        poles = [np.linalg.eigvals(discrete(getattr(solved, c).filter, DT).a) for c in MOVES]
        assert min(np.real(p).min() for p in poles) > -0.05


def test_what_is_felt_is_the_acceleration_and_gravity_in_the_tilted_cab():
    force = trace(4.0, lambda t: np.column_stack([SMALL * np.sin(t), 0.0 * t]))
    machine = boundless()
    policy = OptimalWashout(OPEN, machine.cab)
    felt = rollout(policy, force, machine)
    frame = memories(policy, force, machine)["frame"]
    acceleration = np.diff(frame["velocity"][:, 0]) / DT
    turning = np.diff(frame["tilt_rate"][:, 1]) / DT * machine.cab.reference_point[2]
    expected = acceleration + turning + 9.81 * frame["tilt"][1:, 1]
    np.testing.assert_allclose(felt.f_simulator[2:, 0], expected, atol=1e-4 * SMALL)


def test_a_sustained_force_ends_as_tilt_and_a_sustained_turn_goes_on():
    drive = trace(
        40.0,
        lambda t: np.column_stack([np.where(t > 1.0, 1.0, 0.0), 0.0 * t]),
    )
    felt = rollout(OptimalWashout(OPEN), drive, PAPER)
    assert not felt.limits_active.any()
    assert felt.f_simulator[-1, 0] == pytest.approx(1.0, abs=0.3)
    assert np.abs(felt.carriage[-1]).max() < 0.3 * np.abs(felt.carriage[:, 0]).max()
    turning = trace(10.0, rate=lambda t: np.column_stack([0.0 * t, 0.0 * t, np.full_like(t, 0.1)]))
    felt = rollout(OptimalWashout(OPEN), turning, PAPER)
    assert felt.w_simulator[-1, 2] == pytest.approx(0.1, rel=0.3)
    assert felt.turntable[-1] > 0.5


def test_in_a_turn_the_force_stays_where_the_driver_is():
    """The cab turns on the hexapod; the tilt that stands for a side force turns against it."""
    rate = 0.15
    drive = trace(
        30.0,
        lambda t: np.column_stack([0.0 * t, 1.5 * np.clip(0.2 * t, 0.0, 1.0)]),
        lambda t: np.column_stack([0.0 * t, 0.0 * t, rate * np.clip(0.2 * t, 0.0, 1.0)]),
    )
    felt = rollout(OptimalWashout(OPEN), drive, boundless())
    assert felt.f_simulator[-500:, 1].mean() == pytest.approx(1.5, rel=0.2)
    assert abs(felt.f_simulator[-500:, 0].mean()) < 0.4


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_yaw_is_split_between_turntable_and_hexapod(share):
    drive = trace(4.0, rate=lambda t: np.column_stack([0.0 * t, 0.0 * t, 0.1 * np.sin(t)]))
    felt = rollout(OptimalWashout(replace(OPEN, turntable_share=share)), drive, PAPER)
    whole = felt.turntable + felt.hexapod[:, 5]
    np.testing.assert_allclose(felt.turntable, share * whole, atol=1e-6)
    assert np.abs(whole).max() > 0.05


def test_after_a_violent_drive_the_machine_comes_home():
    def burst(t):
        return np.where(t < 4.0, 1.0, 0.0)[:, None] * np.column_stack(
            [9.0 * np.sin(2.0 * t), 9.0 * np.cos(t)]
        )

    felt = rollout(OptimalWashout(replace(OPEN, force_limit=(10.0,) * 3)), trace(90.0, burst), PAPER)
    assert felt.limits_active.any()
    assert not felt.limits_active[-2000:].any()
    assert np.abs(felt.carriage[-1]).max() < 0.01
    assert np.abs(felt.hexapod[-1, :5]).max() < 0.001


def test_it_begins_where_the_machine_is():
    drive = trace(2.0)
    felt = rollout(OptimalWashout(replace(OPEN, start_carriage=(3.0, -2.0))), drive, PAPER)
    np.testing.assert_allclose(felt.carriage, np.tile([3.0, -2.0], (len(felt.time), 1)), atol=1e-9)
    np.testing.assert_allclose(felt.f_simulator[:, :2], 0.0, atol=1e-9)


def test_dearer_displacement_means_less_of_it_and_dearer_tilt_rate_slower_tilt():
    push = trace(8.0, lambda t: np.column_stack([np.clip(t - 1.0, 0.0, 1.0), 0.0 * t]))

    def peaks(**weights):
        p = replace(OPEN, surge=replace(OPEN.surge, **weights))
        felt = rollout(OptimalWashout(p), push, boundless())
        return np.abs(felt.carriage[:, 0]).max(), np.abs(felt.hexapod_rate[:, 4]).max()

    plain = peaks()
    assert peaks(displacement=0.3 * OPEN.surge.displacement)[0] < 0.8 * plain[0]
    assert peaks(tilt_rate=0.3 * OPEN.surge.tilt_rate)[1] < 0.8 * plain[1]


def test_a_batch_has_the_scores_of_single_rollouts():
    drive = trace(4.0, lambda t: np.column_stack([0.8 * np.sin(2.0 * t), 0.5 * np.sin(3.0 * t)]))
    sets = [START, OPEN]
    scores = WashoutBatch(sets, [drive], PAPER).scores()
    for i, parameters in enumerate(sets):
        metrics = measure(rollout(OptimalWashout(parameters), drive, PAPER))
        assert scores.cue_error[i, 0] == pytest.approx(metrics.cue_error, rel=1e-9)


@pytest.mark.parametrize("name", ["optimal-washout", "optimal-washout-tuned"])
def test_presets_round_trip_through_yaml_and_policies_can_be_copied(name, tmp_path):
    parameters = load_of("optimal", name)
    save(parameters, tmp_path / "mine.yaml")
    assert load_of("optimal", tmp_path / "mine.yaml") == parameters
    policy = OptimalWashout(name)
    assert policy.name == name
    assert copy.deepcopy(policy).parameters == parameters


def test_wrong_parameters_are_refused():
    with pytest.raises(UnknownNameError, match="Did you mean optimal-washout"):
        load_of("optimal", "optimal-washer")
    with pytest.raises(UnknownNameError, match="unknown vestibular model 'telbn'"):
        OptimalParameters("x", vestibular="telbn")
    with pytest.raises(ConfigurationError, match="displacement"):
        PlaneWeights(displacement=0.0)
    with pytest.raises(ConfigurationError, match="no optimal washout has these weights"):
        design(replace(START, surge=PlaneWeights(displacement=1e-150, acceleration=1e150)))
