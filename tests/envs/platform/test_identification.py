"""Lag and dead time found again in logs of machines whose lag and dead time are known."""

import numpy as np
import pytest
from scipy.signal import lsim

from motion_cueing.envs.errors import DataError
from motion_cueing.envs.platform.identification import identify
from motion_cueing.envs.platform.machines import ActuatorDynamics
from motion_cueing.envs.platform.motion_log import Channel, MotionLog

from .motion_logs import log_of, simulated

CASES = {
    "slow and late": (ActuatorDynamics(natural_frequency=30.0, dead_time=0.05), {}),
    "quick": (ActuatorDynamics(natural_frequency=90.0), {}),
    "usual, poor sensors": (
        ActuatorDynamics(natural_frequency=50.0, dead_time=0.02),
        {"noise": 2e-3, "quantum": 1e-3},
    ),
    "overdamped": (ActuatorDynamics(natural_frequency=25.0, damping=2.0, dead_time=0.03), {}),
    "no lag": (ActuatorDynamics(dead_time=0.04), {}),
}


@pytest.mark.parametrize(("dynamics", "errors"), CASES.values(), ids=CASES)
def test_what_the_simulator_does_is_found_again(dynamics, errors):
    """Lateness within 1 ms; for the hexapod dead time within 5 ms, natural frequency and damping within 10 %.

    Carriage and turntable hold less of the motion that tells lag from dead time: their intervals say so.
    """
    found = identify(log_of(*simulated(dynamics, **errors)))
    assert [one.subsystem for one in found] == ["carriage", "hexapod", "turntable"]
    for one in found:
        assert one.lateness.value == pytest.approx(dynamics.lateness, abs=1e-3)
        assert all(gain == pytest.approx(1.0, abs=0.01) for gain in one.gains.values())
        if dynamics.natural_frequency is None:
            assert one.natural_frequency is None
    hexapod = found[1]
    assert hexapod.dead_time.value == pytest.approx(dynamics.dead_time, abs=5e-3)
    if dynamics.natural_frequency is not None:
        assert hexapod.natural_frequency.value == pytest.approx(dynamics.natural_frequency, rel=0.1)
        assert hexapod.damping.value == pytest.approx(dynamics.damping, rel=0.1)


def test_each_subsystem_has_its_own():
    dynamics = {
        "carriage": ActuatorDynamics(natural_frequency=20.0, dead_time=0.03),
        "hexapod": ActuatorDynamics(natural_frequency=70.0, dead_time=0.01),
    }
    carriage, hexapod, turntable = identify(log_of(*simulated(dynamics)))
    assert carriage.dynamics.lateness == pytest.approx(0.13, abs=1e-3)
    assert hexapod.dynamics.lateness == pytest.approx(0.01 + 2.0 / 70.0, abs=1e-3)
    assert turntable.dynamics.lateness == pytest.approx(0.0, abs=1e-3)


def test_intervals_hold_the_truth_about_as_often_as_they_say():
    """White noise of the sensors: of 40 intervals of 95 % at least 33 hold; fewer are a chance of 1e-3."""
    true = ActuatorDynamics(natural_frequency=40.0, dead_time=0.02)
    setpoint, clean = simulated(true, seconds=15.0, noise=0.0, quantum=0.0)
    rng, held = np.random.default_rng(1), 0
    for _ in range(20):
        noisy = clean + 2e-3 * rng.standard_normal(clean.shape)
        (found,) = identify(log_of(setpoint, noisy, which=range(2, 8)))
        low, high = found.dead_time.interval
        held += low <= true.dead_time <= high
        low, high = found.lateness.interval
        held += low <= true.lateness <= high
    assert held >= 33


def test_rates_of_a_kilohertz_and_dead_times_between_samples():
    """Against SciPy's simulation of the transfer function, at another time step and a fractional delay."""
    omega, dead_time, step = 45.0, 0.0234, 1e-3
    time = step * np.arange(15_000)
    motion = 0.3 * np.sin(2.0 * np.pi * 0.4 * time) + 0.05 * np.sin(2.0 * np.pi * 1.7 * time)
    late = np.interp(time - dead_time, time, motion)
    _, lagged, _ = lsim(([omega**2], [1.0, 2.0 * omega, omega**2]), late, time)
    sensor = 0.02 + lagged + 1e-4 * np.random.default_rng(0).standard_normal(len(time))
    (found,) = identify(MotionLog(step, (Channel("roll", motion, sensor),)))
    assert found.natural_frequency.value == pytest.approx(omega, rel=0.02)
    assert found.dead_time.value == pytest.approx(dead_time, abs=5e-4)
    assert found.residual["roll"] == pytest.approx(1e-4, rel=0.1)


LATE = ActuatorDynamics(natural_frequency=40.0, dead_time=0.03)
SETPOINT, SENSOR = simulated(LATE, seconds=20.0)


def changed(change):
    sensor = SENSOR.copy()
    change(sensor)
    return log_of(SETPOINT, sensor, which=(0, 1))


def times(factor):
    def change(sensor):
        sensor[:, :2] *= factor

    return change


def drifting(sensor):
    n = len(sensor)
    stamps = np.arange(n) - np.linspace(0.0, 6.0, n)
    sensor[:, :2] = np.stack([np.interp(stamps, np.arange(n), one) for one in SENSOR[:, :2].T], axis=1)


def unrelated(sensor):
    sensor[:, :2] = SENSOR[::-1, :2]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (times(1000.0), "moves 1e.03 times as far as its set-point; give the units"),
        (times(-1.0), "moves -1 times as far"),
        (times(1e-3), "give its unit"),
        (drifting, "drift apart"),
        (unrelated, "does not follow its set-point"),
    ],
)
def test_sensors_of_another_unit_or_clock_are_refused(change, sentence):
    with pytest.raises(DataError, match=sentence):
        identify(changed(change))


def test_sensors_that_move_first_are_refused():
    """Exchanged columns: the machine is 80 ms late, so its set-point seems to come as much too late."""
    with pytest.raises(DataError, match="before its set-point: set-points and sensors have different clocks"):
        identify(log_of(SENSOR, SETPOINT, which=range(2, 8)))


def test_a_machine_that_hardly_moves_is_refused():
    with pytest.raises(DataError, match="carriage_x hardly moves"):
        identify(log_of(1e-5 * SETPOINT, 1e-5 * SENSOR))


def test_slow_motion_among_noise_does_not_tell():
    time = 0.01 * np.arange(3000)
    slow = 0.02 * np.sin(2.0 * np.pi * 0.05 * time)
    sensor = slow + 2e-3 * np.random.default_rng(0).standard_normal(len(time))
    with pytest.raises(DataError, match="does not tell how late the turntable is"):
        identify(MotionLog(0.01, (Channel("turntable", slow, sensor),)))


def test_a_log_without_the_subsystem_is_refused():
    with pytest.raises(DataError, match="no set-points and sensors of turntable"):
        identify(log_of(SETPOINT, SENSOR, which=(0, 1)), ["turntable"])
