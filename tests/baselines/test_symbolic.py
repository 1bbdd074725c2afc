"""The machine in symbols against the one in numbers."""

from __future__ import annotations

import casadi as cs
import numpy as np
import pytest

from motion_cueing.baselines.symbolic import SymbolicMachine, cues
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.platform import actuator_limits
from motion_cueing.envs.simulator.simulator import Simulator

from ..envs.platform.platforms_under_test import PRESETS
from ..reference.cues import simulator_cues
from ..reference.kinematics import clearance, legs_of
from ..reference.machine import MachineModel
from ..reference.setpoint import MotionState

AGREE = 1e-9
REACH = np.array([5.0, 5.0, 0.3, 0.3, 0.2, 0.25, 0.25, 0.4, 3.0])


def random_motion(n: int, size: float = 1.0, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, rates and accelerations (9, n)."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.0, 1.0, size=(9, n)) * REACH[:, None] * size
    return q, rng.normal(size=(9, n)), 3.0 * rng.normal(size=(9, n))


def reference_motion(q: np.ndarray, v: np.ndarray) -> MotionState:
    """Carriage and turntable among the actuators, and the pose; legs do not matter to cues."""
    return MotionState(q.T, v.T, q[2:8].T, v[2:8].T)


@pytest.mark.parametrize("name", PRESETS)
def test_cues_are_those_of_the_reference(name):
    q, v, a = random_motion(200)
    reference_force, reference_rate, wanted_head = simulator_cues(
        MachineModel.of(PRESETS[name]), reference_motion(q, v), a.T
    )
    machine = SymbolicMachine(PRESETS[name])
    force, rate = machine.cues(q, v, a)
    cab = PRESETS[name].cab
    symbols = [cs.SX.sym(part, 9) for part in "qva"]
    at_head = cues(cs.DM(cab.reference_point) + cs.DM(cab.head), *symbols)
    head, head_rate = cs.Function("head", symbols, list(at_head))(q, v, a)
    for found, wanted in [(force, reference_force), (rate, reference_rate), (head, wanted_head)]:
        assert np.abs(np.array(found).T - wanted).max() < AGREE
    assert np.array_equal(np.array(rate), np.array(head_rate))


@pytest.mark.parametrize("name", PRESETS)
def test_legs_and_clearance_are_those_of_the_reference(name):
    q, v, _ = random_motion(200, size=1.0 if name in ("paper", "nads-1") else 0.3)
    model, machine = MachineModel.of(PRESETS[name]), SymbolicMachine(PRESETS[name])
    extensions, rates = legs_of(model, q[2:8].T, v[2:8].T)
    assert np.abs(np.array(machine.legs(q)).T - extensions).max() < AGREE
    assert np.abs(np.array(machine.leg_rates(q, v)).T - rates).max() < AGREE
    assert np.abs(np.array(machine.clearance(q))[0] - clearance(model, q[2:8].T)).max() < AGREE


def test_leg_accelerations_are_the_derivative_of_leg_rates_along_the_motion():
    machine = SymbolicMachine(PRESETS["paper"])
    q, v, a = (cs.SX.sym(name, 9) for name in "qva")
    along = cs.jtimes(machine.leg_rates(q, v), q, v) + cs.jtimes(machine.leg_rates(q, v), v, a)
    both = cs.Function("both", [q, v, a], [machine.leg_motion(q, v, a).acceleration, along])
    acceleration, derivative = (np.array(part) for part in both(*random_motion(200, seed=1)))
    assert np.abs(acceleration - derivative).max() < AGREE


def test_a_motion_of_the_kernel_is_one_of_the_twin():
    """Rates and positions after a step of 10 ms, and cues of the mean acceleration in it."""
    time = 0.01 * np.arange(201)
    drive = CueTrace("rest", time, np.tile([0.0, 0.0, -9.81], (201, 1)), np.zeros((201, 3)))
    simulator, machine = Simulator(PRESETS["paper"], drive), SymbolicMachine(PRESETS["paper"])
    simulator.reset()
    q, v = np.zeros(9), np.zeros(9)
    for k in range(200):
        a = 0.3 * np.sin(0.02 * k * np.arange(1, 10))
        v = v + 0.01 * a
        q = q + 0.01 * (v - 0.005 * a)
        state = simulator.step(a)[0]
        assert state["limits"] == 0
        force, rate = (np.array(part)[:, 0] for part in machine.cues(q, v, a))
        assert np.abs(state["simulator_cue"]["force"] - force).max() < AGREE
        assert np.abs(state["simulator_cue"]["rate"] - rate).max() < AGREE
        assert np.abs(state["motion"]["position"][2:8] - np.array(machine.legs(q))[:, 0]).max() < AGREE
        assert np.abs(state["motion"]["rate"][2:8] - np.array(machine.leg_rates(q, v))[:, 0]).max() < AGREE


def test_limits_are_those_of_the_machine():
    for platform in PRESETS.values():
        limits = SymbolicMachine(platform).limits
        for name, values in actuator_limits(platform).items():
            assert np.array_equal(limits[name], values)
