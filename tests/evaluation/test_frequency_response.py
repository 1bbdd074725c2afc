"""The frequency response against the transfer functions of the washout's filters, by SciPy."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from motion_cueing.baselines import ClassicalWashout, NoMotion
from motion_cueing.baselines.washout.parameters import (
    OPEN,
    HighPass,
    LowPass,
    TiltCoordination,
    WashoutParameters,
)
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.command_line import main
from motion_cueing.evaluation.frequency_probe import (
    OMCT_FREQUENCIES,
    FrequencyTest,
    harmonic,
    probe,
    swelling_sine,
)
from motion_cueing.evaluation.frequency_response import frequency_response
from motion_cueing.evaluation.frequency_tables import load_json, response_table
from motion_cueing.evaluation.metrics import CUE_AXES
from motion_cueing.evaluation.policies import make_policy

DT = 0.01
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
        assert sinusoid.explained == 0.0


class Told:
    """Answers to the drive it is told, not to what it sees: heaves by a part of what is to come."""

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
    """A washout that is driven as one that is told the drive: by itself."""

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


@settings(max_examples=50, deadline=None)
@given(
    st.floats(-3.0, 3.0),
    st.floats(-3.0, 3.0),
    st.floats(-5.0, 5.0),
    st.floats(-0.1, 0.1),
    st.integers(1, 9),
)
def test_the_harmonic_of_a_sinusoid_on_a_line_is_found_exactly(sine, cosine, offset, slope, periods):
    n = 720
    frequency = 2.0 * math.pi * periods / (n * DT)
    time = DT * np.arange(n)
    values = offset + slope * time + sine * np.sin(frequency * time) + cosine * np.cos(frequency * time)
    found, explained = harmonic(values[:, None], frequency, DT)
    assert found[0] == pytest.approx(sine + 1j * cosine, abs=1e-8)
    if abs(found[0]) > 1e-2:
        assert explained[0] == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("frequency", OMCT_FREQUENCIES)
def test_whole_periods_are_whole_samples(frequency):
    one = probe("w_y", frequency, FrequencyTest())
    periods = one.frequency * one.samples * DT / (2.0 * math.pi)
    assert periods == pytest.approx(round(periods), abs=1e-9)
    assert periods >= 2.0 - 1e-9
    assert one.frequency == pytest.approx(frequency, rel=1e-3)
    assert len(one.cues) * DT >= 60.0 + one.samples * DT


def test_the_frequencies_are_the_tests_five_a_decade():
    np.testing.assert_allclose(OMCT_FREQUENCIES, 0.1 * 10.0 ** (0.2 * np.arange(12)), rtol=2e-4)


def test_amplitudes_are_the_tests():
    """1 m/s^2; 6 degrees up to a sixth of a rad/s, 1 deg/s from there."""
    test = FrequencyTest()
    assert test.amplitude("f_y", 3.0) == 1.0
    assert test.amplitude("w_x", 0.1) == pytest.approx(math.radians(0.6))
    assert test.amplitude("w_x", 2.0) == pytest.approx(math.radians(1.0))
    assert FrequencyTest(scale=0.1).amplitude("f_x", 1.0) == pytest.approx(0.1)
    one = probe("w_z", 2.0, test)
    assert np.abs(one.cues.angular_velocity[-one.samples :, 2]).max() == pytest.approx(
        math.radians(1.0), rel=1e-3
    )
    np.testing.assert_array_equal(one.cues.specific_force[0], [0.0, 0.0, -9.81])


def test_derivatives_of_the_swelling_sine_belong_together():
    time = 1e-4 * np.arange(60_000)
    angle, rate, acceleration = swelling_sine(time, 7.0, 3.0)
    np.testing.assert_allclose(np.gradient(angle, time)[1:-1], rate[1:-1], atol=1e-5)
    np.testing.assert_allclose(np.gradient(rate, time)[1:-1], acceleration[1:-1], atol=1e-4)
    assert (angle[0], rate[0], acceleration[0]) == (0.0, 0.0, 0.0)
    np.testing.assert_allclose(angle[30_000:], np.sin(7.0 * time[30_000:]), atol=1e-12)


def test_a_tilted_car_feels_gravity():
    """Nose up presses backward into the seat: f_x > 0; right side down gives f_y < 0; |f| = g."""
    for axis, column, sign in (("w_y", 0, 1.0), ("w_x", 1, -1.0)):
        one = probe(axis, 0.5, FrequencyTest(gravity=True))
        angle = np.cumsum(one.cues.angular_velocity[:, CUE_AXES.index(axis) - 3]) * DT
        force = one.cues.specific_force
        np.testing.assert_allclose(force[:, column], sign * 9.81 * np.sin(angle), atol=2e-3)
        np.testing.assert_allclose(np.linalg.norm(force, axis=1), 9.81, atol=1e-9)


@pytest.mark.parametrize("values", [{"frequencies": (0.0,)}, {"frequencies": (100.0,)}, {"scale": -1.0}])
def test_a_test_that_cannot_be_is_refused(values):
    with pytest.raises(ConfigurationError):
        FrequencyTest(**values)


def test_the_command_writes_everything_and_reads_it_again(tmp_path, capsys):
    out = tmp_path / "out"
    argv = ["frequency-response", "--policy", "no-motion", "classical", "--frequencies", "15.0", "9.0"]
    assert (
        main([*argv, "--axes", "f_y", "w_z", "--amplitude", "0.5", "--settling", "1", "--out", str(out)]) == 0
    )
    shown = capsys.readouterr().out
    assert "classical on paper, 0.5 of the test's amplitudes" in shown
    names = {"bode.png", "matrix.png", "frequency-response.csv", "frequency-response.json"}
    assert {file.name for file in out.iterdir()} == names
    found = load_json(out / "frequency-response.json")
    assert [one.policy for one in found] == ["no-motion", "classical"]
    assert found[1].inputs == ("f_y", "w_z")
    assert len(found[1].sinusoids) == 4
    rows = list(csv.DictReader((out / "frequency-response.csv").open()))
    assert len(rows) == 2 * 4 * 6
    table = response_table(found[1])
    assert table.header == ("rad/s", "9", "15")
    assert [row[0].split(",")[0] for row in table.rows[::2]] == ["f_y", "w_z", "f_y to w_x"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--policy", "classikal"], "classical"),
        (["--policy", "classical", "--axes", "f_w"], "unknown axis"),
        (["--policy", "classical", "--amplitude", "0"], "--amplitude"),
        (["--policy", "classical", "--frequencies", "1000"], "frequencies"),
        ([], "policy"),
    ],
)
def test_wrong_arguments_are_told_in_one_line(words, told, capsys):
    assert main(["frequency-response", *words]) == 2
    assert told in capsys.readouterr().err


def test_another_version_is_refused(tmp_path):
    path = tmp_path / "x.json"
    for content in ("", '{"schema": 9}', "[]"):
        path.write_text(content)
        with pytest.raises(DataError):
            load_json(path)
