"""The frequency response against the transfer functions of the washout's filters, by SciPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal

from motion_cueing.baselines import ClassicalWashout, NoMotion
from motion_cueing.baselines.washout.classical.family import (
    HighPass,
    LowPass,
    TiltCoordination,
    WashoutParameters,
)
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.frequency_response.reporting import response_table
from motion_cueing.evaluation.frequency_response.response import FrequencyTest, frequency_response
from motion_cueing.evaluation.metrics import CUE_AXES
from motion_cueing.evaluation.policies import make_policy

pytestmark = pytest.mark.slow

DT = 0.01
OPEN = HighPass()
PAPER = get_platform("paper")
SHORT = FrequencyTest(frequencies=(0.8, 3.0, 12.0), settling=25.0, settling_periods=1.0, window=5.0)
"""Long enough for the filters of these tests."""

PURE = WashoutParameters(
    name="pure",
    force_scale=(0.8, 0.5, 0.6),
    rate_scale=(0.9, 0.7, 1.0),
    hpr=(HighPass(2, 1.0), HighPass(2, 0.8, 0.7), HighPass(1, 0.9)),
    tilt=None,
    hps=(HighPass(2, 1.2), HighPass(1, 0.9)),
    hpi=(HighPass(1, 0.7), HighPass(2, 1.0), HighPass(2, 2.0, 0.8)),
)
"""A washout without tilt: linear in each axis."""


def blocks(name, frequency):
    """Numerators and denominators on the way of an axis, and what is left: sampling and roll-off."""
    z = np.exp(1j * frequency * DT)
    if name.startswith("f"):
        # What is felt at a sample answers to what was wanted at the one before.
        i = CUE_AXES.index(name)
        chain = [PURE.hps[i], PURE.hpi[i]] if i < 2 else [PURE.hpi[2]]
        return PURE.force_scale[i], chain, 1.0 / z
    i = CUE_AXES.index(name) - 3
    step = DT * PURE.rate_bandwidth / (1.0 + 0.5 * DT * PURE.rate_bandwidth)
    return PURE.rate_scale[i], [PURE.hpr[i]], step / (z - 1.0 + step)


def transfer(name, frequency):
    """The response of an axis to itself, from the filters' coefficients."""
    scale, chain, rest = blocks(name, frequency)
    total = scale * rest
    for block in chain:
        numerator = [1.0] + [0.0] * block.order
        w = block.frequency
        denominator = [1.0, w] if block.order == 1 else [1.0, 2.0 * block.damping * w, w * w]
        b, a = signal.bilinear(numerator, denominator, 1.0 / DT)
        total *= signal.freqz(b, a, [frequency * DT])[1][0]
    return total


@pytest.mark.parametrize(("scale", "tolerance"), [(0.01, 1e-3), (1.0, 2e-2)])
def test_a_washout_without_tilt_has_the_transfer_function_of_its_filters(scale, tolerance):
    """Exactly for force; for rotation as far as angles are small."""
    test = FrequencyTest(**{**vars(SHORT), "scale": scale})
    found = frequency_response(ClassicalWashout(PURE), PAPER, test)
    for axis in CUE_AXES:
        frequencies = found.frequencies(axis)
        expected = [transfer(axis, w) for w in frequencies]
        exact = 1e-4 if axis.startswith("f") else tolerance
        np.testing.assert_allclose(found.response(axis, axis), expected, rtol=exact, atol=1e-5)
    assert all(s.at_limit == 0.0 for s in found.sinusoids)
    assert min(s.explained for s in found.sinusoids) > 0.999


def test_tilt_coordination_fills_in_what_the_high_passes_take_out():
    """f = HP (1 - T) + T, T = LP (1 - h s^2 / g): the cab is h above the point it tilts about."""
    w_lp, w_hp = 4.0, 1.0
    tilt = TiltCoordination(LowPass(w_lp), rate=10.0, acceleration=100.0, approach=100.0)
    washout = WashoutParameters(
        name="tilting",
        hpr=(OPEN, OPEN, OPEN),
        rate_scale=(0.0, 0.0, 0.0),
        tilt=tilt,
        hps=(OPEN, OPEN),
        hpi=(HighPass(2, w_hp), HighPass(2, w_hp), HighPass(2, 2.0)),
    )
    test = FrequencyTest(frequencies=(0.3, 1.0, 3.0), scale=0.02, settling=40.0, settling_periods=1.0)
    found = frequency_response(ClassicalWashout(washout), PAPER, test, ("f_x", "f_y"))
    s = 1j * found.frequencies("f_x")
    low, high = w_lp**2 / (s + w_lp) ** 2, s**2 / (s + w_hp) ** 2
    tilted = low * (1.0 - 0.8 * s**2 / 9.81)
    for axis in ("f_x", "f_y"):
        np.testing.assert_allclose(found.response(axis, axis), high * (1.0 - tilted) + tilted, atol=0.03)
    # Nose up gives f_x > 0, right side down f_y < 0: the rate of the tilt is s times the angle.
    np.testing.assert_allclose(found.response("f_x", "w_y"), s * low / 9.81, rtol=0.05)
    np.testing.assert_allclose(found.response("f_y", "w_x"), -s * low / 9.81, rtol=0.05)


def test_a_limit_on_the_tilt_rate_shows_as_distortion():
    tilt = TiltCoordination(LowPass(5.0), rate=math.radians(3.0))
    washout = WashoutParameters(name="slow tilt", tilt=tilt)
    explained = []
    for scale in (0.05, 3.0):
        test = FrequencyTest(frequencies=(1.0,), scale=scale, settling=20.0, window=10.0)
        found = frequency_response(ClassicalWashout(washout), PAPER, test, ("f_y",))
        explained.append(found.sinusoids[0].explained)
    assert explained[0] > 0.9999
    assert explained[1] < 0.995


def test_no_motion_answers_to_nothing():
    test = FrequencyTest(frequencies=(5.0,), settling=0.0, settling_periods=1.0, window=1.0)
    found = frequency_response(NoMotion(), PAPER, test)
    assert len(found.sinusoids) == 6
    for sinusoid in found.sinusoids:
        assert max(sinusoid.modulus.values()) < 1e-12
        assert set(sinusoid.phase.values()) == {None}
        assert sinusoid.explained == 0.0
    assert not np.any(found.response("f_x", "f_x"))
    cells = {cell for row in response_table(found).rows for cell in row[1:]}
    assert cells == {"0", "–"}


class Told:
    """Answers to the drive it is given, not to its observation: heaves by a part of what is to come."""

    name = "told"

    def for_drive(self, cues):
        asked = np.zeros((len(cues), 9))
        asked[:, 4] = 0.5 * (cues.specific_force[:, 2] + 9.81)

        class Plan:
            """The drive's accelerations, one after another."""

            def predict(self, observation, state=None, episode_start=None, deterministic=True):
                k = 0 if state is None else state
                return asked[k + 1], k + 1

        return Plan()


def test_a_policy_that_knows_the_drive_has_no_delay():
    test = FrequencyTest(frequencies=(6.0,), settling=2.0, window=4.0)
    found = frequency_response(Told(), PAPER, test, ("f_z",))
    # f = a - g: the plan asks for half of what the car has.
    assert found.response("f_z", "f_z")[0] == pytest.approx(0.5, abs=1e-3)


class Alone:
    """A washout that is driven as one that is given the drive: by itself."""

    name = "alone"

    def for_drive(self, cues):
        return ClassicalWashout("classical")


def test_a_batch_gives_what_each_drive_gives_alone():
    test = FrequencyTest(frequencies=(9.0,), settling=1.0, window=1.0)
    together = frequency_response(ClassicalWashout("classical"), PAPER, test)
    alone = frequency_response(Alone(), PAPER, test)
    for axis in CUE_AXES:
        for felt in CUE_AXES:
            np.testing.assert_allclose(
                together.response(axis, felt), alone.response(axis, felt), rtol=1e-9, atol=1e-12
            )


def test_an_agent_is_tested_in_its_own_environment():
    test = FrequencyTest(frequencies=(1.0,), settling=6.0, settling_periods=1.0, window=6.0)
    found = frequency_response(make_policy("learned-preview", PAPER), PAPER, test, ("f_y",))
    assert found.policy == "learned-preview"
    assert 0.8 < found.sinusoids[0].modulus["f_y"] < 1.2
