"""The washout as a whole: what the paper derives of it, and how it behaves as a policy."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
import warp as wp
import yaml
from scipy import signal

from motion_cueing.baselines import ClassicalWashout, NoMotion, Policy, make_policy
from motion_cueing.baselines.washout import (
    HighPass,
    LowPass,
    ScheduledWashout,
    TiltCoordination,
    WashoutParameters,
    load_washout,
    washout_presets,
)
from motion_cueing.baselines.washout.batch import WashoutBatch
from motion_cueing.baselines.washout.families import family_presets, load_parameters
from motion_cueing.baselines.washout.kernels.blocks import Memory
from motion_cueing.envs.arrays import vec9
from motion_cueing.envs.errors import ConfigurationError, DataError, UnknownNameError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import load, save, to_dict
from motion_cueing.envs.simulator.kernels.observation import OBSERVATION_SIZE
from motion_cueing.evaluation import rollout

from ..drives import DT, boundless, trace, weave

PAPER = get_platform("paper")
OPEN = (HighPass(), HighPass(), HighPass())


def yawing(t):
    ramp = np.clip((t - 0.5) / 2.0, 0.0, 1.0)
    return ramp[:, None] * np.column_stack(
        [0.02 * np.sin(2.0 * t), 0.02 * np.sin(1.6 * t), 0.3 * np.sin(0.7 * t)]
    )


def open_washout(**changes) -> WashoutParameters:
    values = {
        "name": "open", "hpr": OPEN, "tilt": None, "hps": OPEN[:2], "hpi": OPEN,
        "lpc": LowPass(8.0), "rate_bandwidth": 190.0, "rate_limit": (5.0, 5.0, 5.0),
    } | changes  # fmt: skip
    return WashoutParameters(**values)


def test_without_filters_the_driver_feels_the_car():
    """Eqs. (41) to (46): every block opened, f_SS = f'_AA and omega_SS = omega'_AA, turning and tilting."""
    drive = trace(12.0, weave, yawing)
    felt = rollout(ClassicalWashout(open_washout()), drive, boundless())
    assert not felt.limits_active.any()
    # The action of a sample acts until the next one: simulator cues are one sample old.
    error = felt.f_simulator[1:] - felt.f_reference[:-1]
    assert np.abs(error[5:]).max() < 0.03
    assert np.abs(felt.w_simulator[2:] - felt.w_reference[:-2])[5:].max() < 0.01
    assert np.abs(felt.turntable).max() > 0.5


def test_scaling_and_limiting_of_the_inputs():
    scaled = replace(open_washout(), force_scale=(0.5, 1.0, 1.0), force_limit=(10.0, 1.0, 10.0))
    felt = rollout(ClassicalWashout(scaled), trace(10.0, weave), boundless())
    np.testing.assert_allclose(felt.f_simulator[6:, 0], 0.5 * felt.f_reference[5:-1, 0], atol=0.02)
    np.testing.assert_allclose(
        felt.f_simulator[6:, 1], np.clip(felt.f_reference[5:-1, 1], -1.0, 1.0), atol=0.02
    )


def test_the_translational_path_is_hps_times_hpi():
    """Frequency response of the force path against the analytic product of the two filters."""
    omega, w_s, w_i = 1.7, 0.6, 0.3
    drive = trace(80.0, lambda t: np.column_stack([np.zeros_like(t), 0.8 * np.sin(omega * t)]))
    filtered = open_washout(
        hps=(HighPass(2, w_s),) * 2, hpi=(HighPass(1, w_i), HighPass(1, w_i), HighPass(2, 2.0))
    )
    felt = rollout(ClassicalWashout(filtered), drive, boundless())
    late = felt.time > 40.0
    basis = np.column_stack([np.sin(omega * felt.time[late]), np.cos(omega * felt.time[late])])
    (a, b), *_ = np.linalg.lstsq(basis, felt.f_simulator[late, 1], rcond=None)
    s = 1j * omega
    expected = 0.8 * s**2 / (s + w_s) ** 2 * s / (s + w_i) * np.exp(-0.5 * s * 0.01)
    assert a + 1j * b == pytest.approx(expected, abs=0.01)


def test_the_carriage_takes_the_low_pass_of_the_whole():
    """Eqs. (49) to (51): C' = LPC Q', and carriage and hexapod add up."""
    felt = rollout(ClassicalWashout(open_washout(lpc=LowPass(3.0))), trace(8.0, weave), boundless())
    whole = felt.carriage[:, 1] + felt.hexapod[:, 1]
    _, low, _ = signal.lsim(([9.0], [1.0, 6.0, 9.0]), whole, felt.time)
    np.testing.assert_allclose(felt.carriage[:, 1], low, atol=0.02 * np.ptp(whole))


def test_without_turntable_or_carriage_they_stand_still():
    still = replace(load_washout("classical"), turntable_share=0.0, lpc=None)
    felt = rollout(ClassicalWashout(still), trace(6.0, weave, yawing))
    assert not felt.turntable.any()
    assert not felt.carriage.any()
    assert np.abs(felt.hexapod[:, 5]).max() > 0.05


def test_a_sustained_force_ends_as_tilt_at_the_limited_rate():
    step = trace(20.0, lambda t: np.column_stack([np.where(t > 1.0, 1.5, 0.0), np.zeros_like(t)]))
    tilt = TiltCoordination(rate=np.radians(3.0), acceleration=np.radians(8.0))
    felt = rollout(ClassicalWashout(replace(load_washout("est1"), tilt=tilt)), step)
    assert felt.f_simulator[-1, 0] == pytest.approx(1.5, abs=0.05)
    assert np.abs(felt.hexapod_rate[:, 3:5]).max() <= np.radians(3.0) + 1e-9


def burst(t):
    """Five seconds of what no machine of this kind can follow."""
    on = (t > 1.0) & (t < 6.0)
    return np.column_stack([np.where(on, -9.0, 0.0), np.where(on, -6.0, 0.0)])


def spin(t):
    return np.column_stack([np.zeros_like(t), np.zeros_like(t), np.where((t > 1.0) & (t < 6.0), 0.8, 0.0)])


@pytest.mark.slow
def test_after_a_violent_drive_the_machine_comes_home():
    """No drift: with every preset, also where the paper's filters alone would leave it anywhere."""
    sets = [load_washout(name) for name in washout_presets()]
    drive = trace(300.0, burst, spin)
    batch = WashoutBatch(sets, [drive], PAPER)
    simulator, kernels = batch.simulator, batch.kernels
    memory, action = wp.zeros(len(sets), dtype=kernels.memory), wp.zeros(len(sets), dtype=vec9)
    limited = np.zeros((len(drive), len(sets)), dtype=bool)
    for k in range(1, len(drive)):
        inputs = [batch.parameters, batch.parameters_of, simulator.state_array, memory, int(k == 1), DT]
        wp.launch(kernels.act, len(sets), inputs=inputs, outputs=[memory, action])
        limited[k] = simulator.step(action.numpy())["limits"] != 0
    assert (limited.sum(axis=0) > 50).all()
    assert not limited[-10000:].any()
    turned = np.abs(spin(drive.time)[:, 2]).sum() * DT
    for p, state in zip(sets, simulator.state["motion"], strict=True):
        # A HPS of 0.05 rad/s, as EST's, returns from so far in this time to within a meter or two by itself.
        slowest = min((part.frequency for part in p.hps if part.order == 2), default=1.0)
        near = 2.0 if slowest <= 0.05 else 0.01
        assert np.abs(state["position"][:2] - p.start_carriage).max() < near, p.name
        assert np.abs(state["displacement"][:2]).max() < 0.1, p.name
        assert np.abs([state["displacement"][2], *state["beta"][:2]]).max() < 1e-3, p.name
        # The hexapod's part of the yaw returns as HPR lets it, which with a turntable may be hardly at all.
        left = np.exp(-290.0 * p.hpr[2].frequency) * (1.0 - p.turntable_share)
        assert np.abs(state["beta"][2]) < 1e-3 + left * turned, p.name


def test_limits_do_not_wind_up():
    """A minute after open filters met the limits the machine is back."""
    parameters = replace(load_washout("classical"), force_scale=(1.0, 1.0, 1.0), hps=OPEN[:2])
    felt = rollout(ClassicalWashout(parameters), trace(60.0, burst))
    assert felt.limits_active.any(axis=1).mean() > 0.02
    assert np.abs(felt.carriage[-1]).max() < 0.5
    assert np.abs(felt.hexapod[-1, :2]).max() < 0.05
    assert not felt.limits_active[-500:].any()


def test_without_a_limit_nothing_leads_the_reference_home():
    """The way home after a limit is not a part of the algorithm where none was met."""
    gentle = trace(20.0, lambda t: 0.2 * weave(t), lambda t: 0.3 * yawing(t))
    plain = replace(load_washout("est1"), return_frequency=0.0)
    drives = [rollout(ClassicalWashout(p), gentle, boundless()) for p in ("est1", plain)]
    assert not drives[0].limits_active.any()
    np.testing.assert_allclose(drives[0].carriage, drives[1].carriage, atol=1e-9)


def test_it_begins_where_the_machine_is():
    start = np.array([5.0, -3.0, 0.1, 0.05, 0.0, 0.0, 0.0, 0.0, 2.0])
    felt = rollout(ClassicalWashout("est1"), trace(5.0), start=start)
    np.testing.assert_allclose(felt.turntable, 2.0, atol=1e-6)
    np.testing.assert_allclose(felt.f_simulator[1], [0.0, 0.0, -9.81], atol=0.6)
    # LPC hands the hexapod's offset over to the carriage; the sum stays.
    np.testing.assert_allclose(felt.carriage[-1] + felt.hexapod[-1, :2], [5.1, -2.95], atol=1e-3)


@pytest.mark.parametrize("name", ["est1", "est3", "lc2", "classical"])
@pytest.mark.parametrize(("axis", "angle"), [(8, 2.0), (7, 0.2)])
def test_a_turned_start_is_no_cue(name, axis, angle):
    """Turntable or hexapod yaw: the driver of a car at rest feels nothing of where the machine began."""
    start = np.zeros(9)
    start[axis] = angle
    felt = rollout(ClassicalWashout(name), trace(6.0), start=start)
    np.testing.assert_allclose(felt.f_simulator, np.tile([0.0, 0.0, -9.81], (len(felt.time), 1)), atol=1e-6)
    np.testing.assert_allclose(felt.w_simulator, 0.0, atol=1e-6)


@pytest.mark.parametrize("gain", [0.7, 1.0, 1.5])
def test_a_scaled_turntable_leaves_the_sustained_force_where_it_belongs(gain):
    """k_yr turns the cab farther or less far than the car; tilt coordination follows the cab's true yaw."""

    def rate(t):
        return np.column_stack([0.0 * t, 0.0 * t, np.where(t > 1.0, 0.1, 0.0)])

    steady = trace(40.0, lambda t: np.column_stack([0.0 * t, np.clip(t - 1.0, 0.0, 1.5)]), rate)
    parameters = replace(load_washout("classical"), force_scale=(1.0, 1.0, 1.0), turntable_gain=gain)
    felt = rollout(ClassicalWashout(parameters), steady)
    np.testing.assert_allclose(felt.f_simulator[-1, :2], [0.0, 1.5], atol=0.05)


def test_its_start_pose_is_a_parameter():
    washout = ClassicalWashout(
        replace(load_washout("est1"), start_carriage=(4.0, 0.0), start_hexapod=(0.0, 0.1, 0.0))
    )
    felt = rollout(washout, trace(1.0))
    np.testing.assert_allclose(felt.carriage[0], [4.0, 0.0])
    np.testing.assert_allclose(felt.hexapod[0, :3], [0.0, 0.1, 0.0])


@pytest.mark.parametrize("name", washout_presets())
def test_presets_round_trip_through_yaml(name, tmp_path):
    preset = load_washout(name)
    assert preset.name == name
    assert preset.description
    save(preset, tmp_path / "copy.yaml")
    assert load(WashoutParameters, tmp_path / "copy.yaml") == preset


def test_a_batch_is_its_rows_and_the_state_is_not_touched():
    rng = np.random.default_rng(3)
    washout = ClassicalWashout("classical")
    observations = rng.normal(size=(2, 4, OBSERVATION_SIZE)) * 0.1
    first, state = washout.predict(observations[0])
    kept = state.copy()
    both, _ = washout.predict(observations[1], state, np.zeros(4, dtype=bool))
    np.testing.assert_array_equal(state, kept)
    for i in range(4):
        alone, alone_state = washout.predict(observations[0, i])
        np.testing.assert_array_equal(alone, first[i])
        again, _ = washout.predict(observations[1, i], alone_state, np.zeros(1, dtype=bool))
        np.testing.assert_array_equal(again, both[i])
    restarted, _ = washout.predict(observations[0], state, np.ones(4, dtype=bool))
    np.testing.assert_array_equal(restarted, first)


@pytest.mark.parametrize("name", ["no-motion", *family_presets()])
def test_every_policy_keeps_the_protocol(name):
    policy = make_policy(name, get_platform("paper"))
    assert isinstance(policy, Policy)
    action, _ = policy.predict(np.zeros(OBSERVATION_SIZE))
    assert action.shape == (9,)
    action, _ = policy.predict(np.zeros((3, OBSERVATION_SIZE)))
    assert action.shape == (3, 9)


def test_no_motion_does_not_move():
    felt = rollout(NoMotion(), trace(3.0, weave, yawing))
    assert not felt.applied.any()
    np.testing.assert_array_equal(felt.f_simulator, np.tile([0.0, 0.0, -9.81], (len(felt.time), 1)))


def test_a_policy_from_a_file(tmp_path):
    save(replace(load_washout("est1"), name="mine"), tmp_path / "mine.yaml")
    assert make_policy(tmp_path / "mine.yaml", get_platform("paper")).name == "mine"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("name: x\nhpz: 1", "unknown field 'hpz'. Did you mean"),
        ("name: x\nturntable_share: 2", "turntable_share"),
        ("name: x\nhps: [{order: 3}, {order: 0}]", "hps.0.order"),
        ("name: x\nlpc: {frequency: -1}", "lpc.frequency"),
        ("name: x\nforce_scale: [1, .nan, 1]", "force_scale.1"),
        ("name: x\nforce_limit: [-1, 1, 1]", "force_limit.0"),
        ("name: x\nrate_bandwidth: 1.0e+6", "rate_bandwidth"),
        ("name: x\nfollow_frequency: 1000", "follow_frequency"),
        ("- 1", "expected fields"),
    ],
)
def test_broken_files_say_which_field(text, told, tmp_path):
    (tmp_path / "bad.yaml").write_text(text)
    with pytest.raises(ConfigurationError) as error:
        load_washout(tmp_path / "bad.yaml")
    assert told in str(error.value)


def test_a_name_and_a_description_may_stand_in_any_file_or_not(tmp_path):
    platform = get_platform("paper")
    for algorithm in ("classical", "adaptive", "optimal", "mpc"):
        path = tmp_path / f"my-{algorithm}.yaml"
        path.write_text(f"algorithm: {algorithm}\n")
        if algorithm == "optimal":
            path.write_text(yaml.safe_dump(unnamed(load_parameters("optimal-washout"))))
        assert make_policy(path, platform).name == f"my-{algorithm}"
        path.write_text(path.read_text() + "name: other\ndescription: of mine\n")
        assert make_policy(path, platform).name in ("other", "my-mpc")


def unnamed(parameters):
    """Values of a file without name and description."""
    return {key: value for key, value in to_dict(parameters).items() if key not in ("name", "description")}


def test_an_algorithm_that_nobody_knows_is_named_with_its_file(tmp_path):
    (tmp_path / "algo.yaml").write_text("algorithm: foo\n")
    known = "classical, adaptive, optimal, mpc, nmpc"
    with pytest.raises(
        ConfigurationError, match=f"algo.yaml: field 'algorithm' is 'foo'; it is one of {known}"
    ):
        make_policy(tmp_path / "algo.yaml", get_platform("paper"))


def test_unknown_names_and_broken_observations():
    with pytest.raises(UnknownNameError, match="Did you mean classical"):
        make_policy("clasical", get_platform("paper"))
    with pytest.raises(DataError, match="cannot be read"):
        make_policy("missing.yaml", get_platform("paper"))
    washout = ClassicalWashout("est1")
    with pytest.raises(DataError, match="shape"):
        washout.predict(np.zeros(7))
    with pytest.raises(DataError, match="not finite"):
        washout.predict(np.full(OBSERVATION_SIZE, np.nan))


ROWS = np.zeros((3, OBSERVATION_SIZE))
MEMORY = np.zeros(len(ROWS), dtype=Memory.numpy_dtype())


@pytest.mark.parametrize("kind", [ClassicalWashout, ScheduledWashout])
@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"observation": [["fast"] * OBSERVATION_SIZE]}, "observation is not numeric; give an array"),
        ({"observation": {"force": 1.0}}, "observation is not numeric; give an array"),
        ({"observation": [[1.0], [1.0, 2.0]]}, "observation is not numeric; give an array"),
        ({"observation": ROWS[None]}, "observation has shape (1, 3, 52), expected (n, 52)"),
        ({"observation": ROWS[:0]}, "observation has shape (0, 52), expected (n, 52)"),
        ({"observation": 1.0}, "observation has shape (), expected (n, 52)"),
        ({"state": "begin"}, "state is of type str; give what the last call"),
        ({"state": (MEMORY,)}, "state is of type tuple; give what the last call"),
        ({"state": np.zeros(3)}, "state is an array of float64 of shape (3,); give what the last call"),
        ({"state": MEMORY[:2]}, "state is an array of washout memory of shape (2,); give what"),
        ({"state": MEMORY[None]}, "state is an array of washout memory of shape (1, 3); give what"),
        (
            {"episode_start": np.zeros(3)},
            "episode_start is an array of float64 of shape (3,); give 3 booleans",
        ),
        ({"episode_start": np.zeros(2, dtype=bool)}, "episode_start is an array of bool of shape (2,)"),
        ({"episode_start": True}, "episode_start is an array of bool of shape (); give 3 booleans"),
        ({"episode_start": "yes"}, "give 3 booleans, one an observation, or None"),
    ],
)
def test_wrong_arguments_are_named_and_leave_the_policy_as_it_was(kind, arguments, told):
    policy = kind("est1")
    observation = np.random.default_rng(6).normal(size=ROWS.shape)
    expected, _ = policy.predict(observation, MEMORY)
    good = {"observation": observation, "state": MEMORY, "episode_start": np.zeros(3, dtype=bool)}
    with pytest.raises(DataError) as error:
        policy.predict(**(good | arguments))
    assert told in str(error.value)
    again, _ = policy.predict(**good)
    assert np.array_equal(again, expected)


def test_memory_that_was_stored_is_taken_back():
    policy = ClassicalWashout("est1")
    observation = np.random.default_rng(7).normal(size=ROWS.shape)
    _, memory = policy.predict(observation)
    expected, _ = policy.predict(observation, memory)
    stored, _ = policy.predict(observation, pickle.loads(pickle.dumps(memory)), [False, False, False])
    assert np.array_equal(stored, expected)
