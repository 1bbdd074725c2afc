"""Every row of the observation against the simulator's state and the drive, in plain NumPy."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from motion_cueing.baselines.washout import ClassicalWashout
from motion_cueing.envs.simulator.kernels.observation import ROWS, SLICES
from motion_cueing.envs.task import ActionOptions, DrivingSimulator, ObservationOptions, RandomizationOptions
from motion_cueing.envs.task.kernels import observation as layout_page

from .tasks import drive

GRAVITY = np.array([0.0, 0.0, 9.81])
LAG = RandomizationOptions(natural_frequency=(15.0, 15.0), platforms=1)


def moved(steps: int = 50, **arguments) -> tuple[DrivingSimulator, np.ndarray]:
    """An environment after some steps of sines, and its observation."""
    env = DrivingSimulator(**({"drives": [drive()]} | arguments))
    observation, _ = env.reset(seed=0)
    for k in range(steps):
        observation, *_ = env.step(0.1 * np.sin(0.1 * k + np.arange(9)))
    return env, observation


def row(env: DrivingSimulator, observation: np.ndarray, name: str, frame: int = 0) -> np.ndarray:
    layout = env.batch.layout
    scale = {row.name: row.scale for row in layout.rows}[name]
    return scale * observation[layout.frame * frame :][layout.slices[name]].astype(np.float64)


def close(a, b) -> bool:
    return bool(np.allclose(a, b, rtol=1e-6, atol=1e-6))


def test_fixed_rows_are_those_of_the_policies_observation():
    env, observation = moved()
    assert env.batch.layout.rows[: len(ROWS)] == ROWS
    for name, where in SLICES.items():
        assert env.batch.layout.slices[name] == where
    assert close(observation[: env.batch.arrays.core.view.shape[1]], env.batch.arrays.core.view[0])


def test_cues_platform_and_legs_are_the_simulators():
    env, observation = moved()
    state = env.batch.simulator.state[0]
    p = state["setpoint"]
    expected = {
        "reference_force": state["reference_cue"]["force"] + GRAVITY,
        "reference_rate": state["reference_cue"]["rate"],
        "simulator_force": state["simulator_cue"]["force"] + GRAVITY,
        "simulator_rate": state["simulator_cue"]["rate"],
        "force_error": state["reference_cue"]["force"] - state["simulator_cue"]["force"],
        "rate_error": state["reference_cue"]["rate"] - state["simulator_cue"]["rate"],
        "carriage": p["position"][:2],
        "carriage_rate": p["rate"][:2],
        "displacement": p["displacement"],
        "velocity": p["velocity"],
        "beta": p["beta"],
        "beta_rate": p["beta_rate"],
        "turntable": [np.sin(p["position"][8]), np.cos(p["position"][8])],
        "turntable_rate": p["rate"][8:],
        "legs": p["position"][2:8] / 0.67,
        "leg_rates": p["rate"][2:8] / 1.0,
        "acceleration": state["acceleration"],
        "last_action": 0.1 * np.sin(4.9 + np.arange(9)),
    }
    assert set(expected) == set(env.batch.layout.slices)
    for name, values in expected.items():
        assert close(row(env, observation, name), values), name
    assert np.array_equal(state["reference_cue"]["force"], drive().specific_force[50])


@pytest.mark.parametrize("steps", [0, 50, 280])
def test_preview_is_the_drive_ahead_and_its_last_cue_after_its_end(steps):
    options = ObservationOptions(preview=4, preview_spacing=0.25)
    env, observation = moved(steps, observation=options)
    cues, ahead = drive(), np.minimum(steps + 25 * np.arange(1, 5), 300)
    seen = row(env, observation, "preview").reshape(4, 6)
    assert close(10.0 * seen[:, :3], cues.specific_force[ahead] + GRAVITY)
    assert close(seen[:, 3:], cues.angular_velocity[ahead])


def test_perceived_rows_are_what_is_sensed():
    env, observation = moved(observation=ObservationOptions(perceived=True))
    state = env.batch.simulator.state[0]
    for side in ("reference", "simulator"):
        sensed = state[f"perceived_{side}"]
        assert close(row(env, observation, f"perceived_{side}_force"), sensed["force"] + GRAVITY)
        assert close(row(env, observation, f"perceived_{side}_rate"), sensed["rate"])
        assert np.abs(sensed["rate"]).max() > 1e-3


def test_true_motion_is_behind_the_set_points_where_actuators_lag():
    env, observation = moved(observation=ObservationOptions(true_motion=True), randomization=LAG)
    true = env.batch.simulator.state[0]["motion"]
    expected = {
        "true_carriage": true["position"][:2],
        "true_carriage_rate": true["rate"][:2],
        "true_displacement": true["displacement"],
        "true_velocity": true["velocity"],
        "true_beta": true["beta"],
        "true_beta_rate": true["beta_rate"],
        "true_turntable": [np.sin(true["position"][8]), np.cos(true["position"][8])],
        "true_turntable_rate": true["rate"][8:],
    }
    for name, values in expected.items():
        assert close(row(env, observation, name), values), name
        if name != "true_turntable":
            assert not close(row(env, observation, name.removeprefix("true_")), values), name


def turned(vector: np.ndarray, angle: float) -> np.ndarray:
    """A vector in axes turned by ``angle``, by complex numbers."""
    z = (vector[0] + 1j * vector[1]) * np.exp(-1j * angle)
    return np.array([z.real, z.imag])


def turn(env: DrivingSimulator, angle: float) -> None:
    """Begin an episode with the turntable at an angle."""
    env.reset(seed=0)
    start = np.zeros((1, 9))
    start[0, 8] = angle
    env.batch.simulator.place(np.ones(1, dtype=bool), start=start)


def test_in_the_cabs_frame_the_machines_rows_turn_with_the_driver():
    seen = ObservationOptions(frame="cab", true_motion=True)
    env = DrivingSimulator(drives=[drive()], observation=seen, randomization=LAG)
    turn(env, 1.2)
    for k in range(50):
        observation, *_ = env.step(0.1 * np.sin(0.1 * k + np.arange(9)))
    state = env.batch.simulator.state[0]
    for prefix, motion in (("", state["setpoint"]), ("true_", state["motion"])):
        psi_t = motion["position"][8]
        psi = psi_t + motion["beta"][2]
        assert abs(psi_t) > 1.0
        for name, values, angle in (
            ("carriage", motion["position"][:2], psi),
            ("carriage_rate", motion["rate"][:2], psi),
            ("displacement", motion["displacement"], psi),
            ("velocity", motion["velocity"], psi),
            ("beta", motion["beta"], psi_t),
            ("beta_rate", motion["beta_rate"], psi_t),
        ):
            shown = row(env, observation, prefix + name)
            assert close(shown[:2], turned(values, angle)), name
            assert close(shown[2:], values[2:]), name
    felt = state["simulator_cue"]["force"] + GRAVITY
    assert close(row(env, observation, "simulator_force"), felt)


@pytest.mark.parametrize("mode", ["acceleration", "jerk", "velocity"])
def test_an_action_in_the_cabs_frame_moves_the_machine_the_same_way_from_any_heading(mode):
    """Equivariance: a turned start turns the whole motion, and the driver feels the same."""
    options = {
        "action": ActionOptions(mode=mode, frame="cab"),
        "observation": ObservationOptions(frame="cab"),
    }
    seen, felt = [], []
    for angle in (0.0, 2.1):
        env = DrivingSimulator(drives=[drive()], **options)
        turn(env, angle)
        for k in range(60):
            observation, *_ = env.step(0.02 * np.sin(0.1 * k + np.arange(9)))
        seen.append([row(env, observation, n) for n in ("carriage", "displacement", "beta", "velocity")])
        felt.append(env.batch.simulator.state["simulator_cue"]["force"][0].copy())
    assert np.abs(seen[0][0]).max() > 0.001
    for a, b in zip(*seen, strict=True):
        assert np.allclose(a, b, atol=1e-5)
    # Roll and pitch do not commute: the frames agree to first order in the tilt.
    assert np.allclose(felt[0], felt[1], atol=1e-3)


def test_memory_is_the_low_passed_past_of_the_car():
    constants, steps = (0.3, 4.0), 50
    env, observation = moved(steps, observation=ObservationOptions(memory=constants))
    cues = env.batch.drives[0]
    inputs = np.hstack([cues.specific_force + GRAVITY, cues.angular_velocity])
    expected = []
    for time_constant in constants:
        y = inputs[0].copy()
        for u in inputs[1 : steps + 1]:
            y += (1.0 - np.exp(-0.01 / time_constant)) * (u - y)
        expected.append(y / np.array([10.0, 10.0, 10.0, 1.0, 1.0, 1.0]))
    assert close(row(env, observation, "memory"), np.concatenate(expected))


def test_stack_holds_earlier_observations_the_newest_first():
    arguments = {"drives": [drive()], "seed": 0}
    stacked = DrivingSimulator(drives=arguments["drives"], observation=ObservationOptions(stack=3))
    single = DrivingSimulator(drives=arguments["drives"])
    seen, first = stacked.reset(seed=0)[0], single.reset(seed=0)[0]
    frames = [first, first, first]
    for k in range(6):
        assert np.array_equal(seen, np.concatenate(frames))
        action = np.full(9, 0.01 * k, dtype=np.float32)
        seen, frames = stacked.step(action)[0], [single.step(action)[0], *frames[:2]]


def test_command_and_base_action_are_shown_where_the_mode_needs_them():
    env, observation = moved(action=ActionOptions(mode="jerk"))
    assert close(row(env, observation, "command"), env.batch.arrays.command.view["own"][0].astype(np.float32))
    policy = ClassicalWashout()
    env, observation = moved(0, action=ActionOptions(mode="residual"), base=ClassicalWashout())
    expected, _ = policy.predict(env.batch.arrays.core.view[0])
    assert close(row(env, observation, "base_action"), expected)


def test_sensors_err_in_gain_and_noise_and_only_they_do():
    noisy = RandomizationOptions(sensor_gain=0.2, force_noise=0.3, rate_noise=0.02)
    env, clean = DrivingSimulator(drives=[drive()], randomization=noisy), DrivingSimulator(drives=[drive()])
    seen, expected = [env.reset(seed=1)[0]], [clean.reset(seed=1)[0]]
    for _ in range(250):
        seen.append(env.step(np.zeros(9))[0])
        expected.append(clean.step(np.zeros(9))[0])
    error = np.array(seen) - np.array(expected)
    touched = {"simulator_force": 0.03, "simulator_rate": 0.02, "force_error": 0.03, "rate_error": 0.02}
    for name, where in env.batch.layout.slices.items():
        if name not in touched:
            assert not error[:, where].any(), name
            continue
        # The standard deviation of 750 samples is within 4 standard errors of the true one.
        assert np.std(error[:, where]) == pytest.approx(touched[name], rel=4.0 / np.sqrt(2 * 750)), name
    felt, difference = (
        error[:, env.batch.layout.slices[name]] for name in ("simulator_force", "force_error")
    )
    assert np.allclose(felt, -difference, atol=1e-6)


def test_noise_differs_from_step_to_step_and_from_episode_to_episode():
    env = DrivingSimulator(drives=[drive()], randomization=RandomizationOptions(force_noise=0.3))
    where = env.batch.layout.slices["simulator_force"]
    seen = [env.reset(seed=1)[0][where], env.step(np.zeros(9))[0][where], env.reset()[0][where]]
    assert len({part.tobytes() for part in seen}) == 3


EVERYTHING = {"preview": 2, "memory": (1.0,), "perceived": True, "true_motion": True, "machine": True}


@pytest.mark.parametrize("mode", ["acceleration", "jerk", "residual"])
def test_every_entry_is_written(mode):
    base = ClassicalWashout() if mode == "residual" else None
    env = DrivingSimulator(drives=[drive()], observation=EVERYTHING, action={"mode": mode}, base=base)
    env.reset(seed=0)
    env.batch.arrays.observation.view[...] = np.nan
    env.batch.arrays.fixed.view[...] = np.nan
    observation, *_ = env.step(np.zeros(9))
    assert np.isfinite(observation).all()


ANOTHER_ROW = """
import importlib.util, sys

PAGE = "motion_cueing.envs.task.kernels.observation"


class Changed:
    def find_spec(self, name, path=None, target=None):
        return importlib.util.spec_from_file_location(name, sys.argv[1]) if name == PAGE else None


sys.meta_path.insert(0, Changed())
import numpy as np
from motion_cueing.envs.task import DrivingSimulator
from motion_cueing.envs.task.kernels import observation as layout_page
from motion_cueing.envs.task.kernels.observation import observation_table

env = DrivingSimulator(episode={"library": 1, "drive_duration": 2.0})
plain, _ = env.reset(seed=0)
for _ in range(5):
    observation, *_ = env.step(np.full(9, 0.1))
where = env.batch.layout.slices
state = env.batch.simulator.state[0]
np.testing.assert_allclose(2.0 * observation[where["height"]], state["motion"]["displacement"][2:], rtol=1e-6)
np.testing.assert_allclose(observation[where["last_action"]], 0.1, rtol=1e-6)
error = state["reference_cue"]["rate"] - state["simulator_cue"]["rate"]
np.testing.assert_allclose(observation[where["rate_error"]], error, rtol=1e-5, atol=1e-7)
assert list(where).index("height") == list(where).index("rate_error") - 1
assert "| `height` | 1 | m | 2 | 2 | 10 | how deep the cab hangs |" in observation_table()
"""


@pytest.mark.slow
def test_another_row_takes_one_page(tmp_path):
    """A row between others: declared and written on one page, and every other row stays right."""
    page = Path(layout_page.__file__).read_text(encoding="utf-8")
    declared, written = '        Row(\n            "rate_error"', "    if f.command >= 0:"
    assert page.count(declared) == page.count(written) == 1
    page = page.replace(
        declared, '        Row("height", 1, 2.0, "m", "how deep the cab hangs"),\n' + declared
    ).replace(
        written,
        '    put_entry(out, i, f.height, s.motion.displacement[2] / wp.static(UNIT["height"]), bounds)\n'
        + written,
    )
    (tmp_path / "observation.py").write_text(page, encoding="utf-8")
    command = [sys.executable, "-c", ANOTHER_ROW, str(tmp_path / "observation.py")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_entries_beyond_their_bound_are_clipped():
    cues = drive()
    wild = np.array(cues.specific_force)
    wild[10:] += 500.0
    env = DrivingSimulator(drives=[type(cues)("wild", cues.time, wild, cues.angular_velocity)])
    observation, _ = env.reset(seed=0)
    for _ in range(20):
        observation, *_ = env.step(np.zeros(9))
    assert np.array_equal(observation[:3], [10.0, 10.0, 10.0])
    assert observation in env.observation_space


def test_the_models_cues_are_those_of_a_machine_that_follows_at_once():
    noisy = RandomizationOptions(**vars(LAG) | {"sensor_gain": 0.2, "force_noise": 0.1, "rate_noise": 0.01})
    told, modeled = moved(observation=ObservationOptions(felt="model", frame="cab"), randomization=noisy)
    swift, sensed = moved(observation=ObservationOptions(frame="cab"))
    late, true = moved(observation=ObservationOptions(frame="cab"), randomization=LAG)
    np.testing.assert_allclose(modeled, sensed, rtol=0.0, atol=2e-5)
    for name in ("simulator_force", "simulator_rate", "acceleration", "force_error", "rate_error"):
        assert not close(row(late, true, name), row(swift, sensed, name)), name
    # What is felt, and counts, is the true motion's all the same.
    felt = told.batch.simulator.state[0]["simulator_cue"]["force"]
    assert not close(felt, row(told, modeled, "simulator_force") - GRAVITY)
