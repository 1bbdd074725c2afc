"""Canals and otoliths against the published transfer functions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import UnknownNameError
from motion_cueing.envs.perception import get_vestibular_model, vestibular_model_names
from motion_cueing.envs.perception.models import discretize
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import from_dict, to_dict
from motion_cueing.envs.simulator.simulator import Simulator

DT = 0.01
S = np.poly1d([1.0, 0.0])

# The published forms, typed anew; otoliths over their gain of 0.4.
OTOLITHS = {
    "zacharias": (13.2 * S + 1, (5.33 * S + 1) * (0.66 * S + 1)),
    "telban": (10.0 * S + 1, (5.0 * S + 1) * (0.016 * S + 1)),
}
CANALS = {
    "zacharias": [
        (t_l * 30.0 * S**2, (t_l * S + 1) * (0.1 * S + 1) * (30.0 * S + 1)) for t_l in (6.1, 5.3, 10.2)
    ],
    "telban": [(5.73 * 80.0 * S**2 * (1 + 0.06 * S), (1 + 80.0 * S) * (1 + 5.73 * S) * (1 + 0.005 * S))] * 3,
}
MODELS = list(OTOLITHS)


def restless(samples: int) -> CueTrace:
    rng = np.random.default_rng(0)
    steps = rng.normal(size=(samples, 6)) * 0.1
    wander = np.cumsum(steps, axis=0) - 0.02 * np.cumsum(np.cumsum(steps, axis=0), axis=0)
    force = wander[:, :3] + [0.0, 0.0, -9.81]
    return CueTrace("restless", DT * np.arange(samples), force, 0.1 * wander[:, 3:])


def perceive(model: str, drive: CueTrace) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Head forces given, and forces and rates sensed in the car, by the simulator."""
    batch = Simulator(get_platform("paper"), drive, vestibular=get_vestibular_model(model))
    rows = [batch.reset()[0].copy()]
    rows += [batch.step(np.zeros(9))[0].copy() for _ in range(len(drive) - 1)]
    record = np.array(rows)
    sensed = record["perceived_reference"]
    return record["reference_cue"]["head_force"], sensed["force"], sensed["rate"]


def respond(transfer, values: np.ndarray, time: np.ndarray) -> np.ndarray:
    """The transfer function's answer to straight lines between samples, from rest under the first value."""
    numerator, denominator = transfer
    system = signal.lti(numerator.c, denominator.c)
    _, moving, _ = signal.lsim(system, values - values[0], time, interp=True)
    return np.asarray(moving + numerator(0.0) / denominator(0.0) * values[0])


@pytest.mark.parametrize("model", MODELS)
def test_sensed_signals_are_the_published_filters_of_the_true_ones(model):
    drive = restless(1500)
    head, force, rate = perceive(model, drive)
    for axis in range(3):
        expected = respond(OTOLITHS[model], head[:, axis], drive.time)
        np.testing.assert_allclose(force[:, axis], expected, atol=1e-9)
        expected = respond(CANALS[model][axis], drive.angular_velocity[:, axis], drive.time)
        np.testing.assert_allclose(rate[:, axis], expected, atol=1e-9)


@pytest.mark.parametrize("model", MODELS)
def test_a_constant_drive_has_been_felt_for_ever(model):
    time = DT * np.arange(300)
    drive = CueTrace("turn", time, np.tile([1.0, 2.0, -9.5], (300, 1)), np.tile([0.1, 0.2, 0.3], (300, 1)))
    head, force, rate = perceive(model, drive)
    np.testing.assert_allclose(force, head, atol=1e-10)
    np.testing.assert_allclose(rate, 0.0, atol=1e-10)


@pytest.mark.parametrize("model", MODELS)
def test_static_gains(model):
    found = get_vestibular_model(model)
    numerator, denominator = found.otoliths.transfer_function()
    assert numerator[-1] / denominator[-1] == 1.0
    assert found.otoliths.gain == 0.4
    for axis in range(3):
        numerator, denominator = found.canals.transfer_function(axis)
        assert numerator[-1] == numerator[-2] == 0.0
        assert denominator[-1] == 1.0


@pytest.mark.parametrize("model", MODELS)
def test_frequency_responses_are_the_published_ones(model):
    s = 1j * np.logspace(-3, 1.5, 40)
    found = get_vestibular_model(model)
    pairs = [(found.otoliths.transfer_function(), OTOLITHS[model])]
    pairs += [(found.canals.transfer_function(axis), CANALS[model][axis]) for axis in range(3)]
    for (numerator, denominator), (top, bottom) in pairs:
        ratio = np.polyval(numerator, s) / np.polyval(denominator, s)
        np.testing.assert_allclose(ratio, top(s) / bottom(s), rtol=1e-12)


@pytest.mark.parametrize("model", MODELS)
def test_discrete_filters_rest_where_a_constant_input_leaves_them(model):
    filters = get_vestibular_model(model)
    for transfer, gain in [
        (filters.otoliths.transfer_function(), 1.0),
        (filters.canals.transfer_function(2), 0.0),
    ]:
        discrete = discretize(*transfer, DT)
        x = discrete.rest
        np.testing.assert_allclose(discrete.a @ x + discrete.b, x, atol=1e-9 * np.abs(x).max())
        assert discrete.c @ x + discrete.d == pytest.approx(gain, abs=1e-9)
        assert np.abs(np.linalg.eigvals(discrete.a)).max() < 1.0


def test_models_round_trip_and_unknown_ones_are_refused():
    assert vestibular_model_names() == sorted(MODELS)
    for name in MODELS:
        model = get_vestibular_model(name)
        assert from_dict(type(model), to_dict(model)) == model
    with pytest.raises(UnknownNameError, match="Did you mean telban"):
        get_vestibular_model("tellban")
