"""Frequency response of a policy on its machine: the objective motion cueing test of ICAO 9625.

Each axis of the car's motion moves alone, in sinusoids. The response of a simulator cue is its modulus and
phase over the reference cue. A policy that is not linear has one response for each amplitude.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ...baselines.interface import Machines
from ...baselines.policy import Policy, as_policy
from ...envs.cues import GRAVITY, CueTrace
from ...envs.platform import Platform
from ...envs.settings import NonNegative, Positive, configuration
from ...envs.simulator.simulator import TIME_STEP
from ..metrics import CUE_AXES
from ..rollout import Rollout
from ..trajectory import Floats

OMCT_FREQUENCIES: Final = (
    0.1, 0.1585, 0.2512, 0.3981, 0.631, 1.0, 1.585, 2.512, 3.981, 6.31, 10.0, 15.849,
)  # fmt: skip
"""The twelve frequencies of ICAO 9625, rad/s: five a decade."""

_LEAST_SAMPLES: Final = 8
"""Samples a period below which a sinusoid at 100 Hz says little."""

_SILENCE: Final = 1e-9
"""Root mean square of a signal that is nothing but rounding, m/s^2 or rad/s."""

_LIMITS = Field(gt=0.0, le=2.0 * math.pi / (_LEAST_SAMPLES * TIME_STEP))


@configuration
class FrequencyTest:
    """How the test is driven; the defaults are those of ICAO 9625 as far as it says.

    Args:
        frequencies: Of the sinusoids, rad/s.
        scale: Of all amplitudes: 1 for the test itself, 0.1 or less for the linear response near rest.
        force: Amplitude of specific force, m/s^2 (ICAO 9625, from memory).
        rate: Largest amplitude of angular velocity, rad/s (1 deg/s; ICAO 9625, from memory).
        attitude: Largest amplitude of attitude, rad, which holds at low frequencies (6 deg; the same).
        gravity: Whether roll and pitch bring the specific force of a tilted car with them. Without it a
            rotation is pure: specific force stays that of rest in the cab's axes.
        settling: Shortest time before the sinusoid is measured, s.
        settling_periods: Shortest number of periods before it is measured.
        window: Shortest time it is measured, s.
        window_periods: Least number of whole periods measured.
    """

    frequencies: tuple[Annotated[float, _LIMITS], ...] = OMCT_FREQUENCIES
    scale: Positive = 1.0
    force: Positive = 1.0
    rate: Positive = math.radians(1.0)
    attitude: Positive = math.radians(6.0)
    gravity: bool = False
    settling: NonNegative = 60.0
    settling_periods: NonNegative = 2.0
    window: Positive = 20.0
    window_periods: Annotated[int, Field(ge=1)] = 2

    def amplitude(self, axis: str, frequency: float) -> float:
        """Of the input on an axis of :data:`CUE_AXES`, m/s^2 or rad/s."""
        if axis.startswith("f"):
            return self.scale * self.force
        return self.scale * min(self.rate, self.attitude * frequency)


@dataclass(frozen=True, eq=False)
class Probe:
    """One input of the test.

    Args:
        cues: The drive: the sinusoid swells while the machine settles, then stays as it is.
        axis: Of :data:`CUE_AXES`, that moves.
        frequency: Of the sinusoid, rad/s: the requested one, moved so that whole periods are whole samples.
        samples: Length of the window at the end of the drive: whole periods.
    """

    cues: CueTrace
    axis: str
    frequency: float
    samples: int


def probe(axis: str, frequency: float, test: FrequencyTest, dt: float = TIME_STEP) -> Probe:
    """The input on an axis at a frequency.

    Args:
        axis: Of :data:`CUE_AXES`.
        frequency: rad/s.
        test: Amplitudes and durations.
        dt: Time step, s.
    """
    period = 2.0 * math.pi / frequency
    periods = max(test.window_periods, math.ceil(test.window / period - 1e-9))
    samples = round(periods * period / dt)
    exact = 2.0 * math.pi * periods / (samples * dt)
    settling = math.ceil(max(test.settling, test.settling_periods * period) / dt)
    time: Floats = dt * np.arange(settling + samples + 1, dtype=np.float64)
    force = np.tile([0.0, 0.0, -GRAVITY], (len(time), 1))
    motion = np.zeros((3, len(time), 3))
    column = CUE_AXES.index(axis)
    swell = max(0.5 * settling * dt, dt)
    if column < 3:
        force[:, column] += test.amplitude(axis, frequency) * swelling_sine(time, exact, swell)[0]
    else:
        angle = test.amplitude(axis, frequency) / exact
        motion[:, :, column - 3] = angle * swelling_sine(time, exact, swell)
        force += _tilted(motion[0]) if test.gravity else 0.0
    cues = CueTrace(f"{axis} at {frequency:g} rad/s", time, force, motion[1], motion[2], source="sinusoid")
    return Probe(cues, axis, exact, samples)


def swelling_sine(time: Floats, frequency: float, swell: float) -> Floats:
    """(3, n) a sine that grows from nothing to 1, and its first and second derivatives.

    Args:
        time: (n,) s.
        frequency: rad/s.
        swell: Time it takes to grow, s; speed and acceleration are continuous.
    """
    part = np.clip(time / swell, 0.0, 1.0)
    size = part**3 * (10.0 - 15.0 * part + 6.0 * part**2)
    growth = 30.0 * part**2 * (1.0 - part) ** 2 / swell
    change = 60.0 * part * (1.0 - part) * (1.0 - 2.0 * part) / swell**2
    sine, cosine = np.sin(frequency * time), np.cos(frequency * time)
    return np.stack(
        [
            size * sine,
            growth * sine + size * frequency * cosine,
            change * sine + 2.0 * growth * frequency * cosine - size * frequency**2 * sine,
        ]
    )


def _tilted(angles: Floats) -> Floats:
    """(n, 3) specific force of a car tilted by angles (n, 3), one of them not 0, less that on the level."""
    roll, pitch = angles[:, 0], angles[:, 1]
    return GRAVITY * np.column_stack(
        [np.sin(pitch), -np.sin(roll) * np.cos(pitch), 1.0 - np.cos(roll) * np.cos(pitch)]
    )


def harmonic(signal: Floats, frequency: float, dt: float) -> tuple[NDArray[np.complex128], Floats]:
    """The sinusoid in signals over whole periods, and how much of them it explains.

    A line is taken out first, as a least-squares fit together with the sinusoid: the rest of a slow start
    is nearly one.

    Args:
        signal: (n, k) signals in columns.
        frequency: rad/s.
        dt: Time step, s.

    Returns:
        (k,) complex amplitudes c, the signal being |c| sin(frequency t + arg c), t from the first row; and
        (k,) shares of the variance about the line that they explain, 1 for a pure sinusoid, 0 for silence.
    """
    time = dt * np.arange(len(signal))
    line = np.column_stack([np.ones_like(time), time - time.mean()])
    wave = np.column_stack([np.sin(frequency * time), np.cos(frequency * time)])
    fit, *_ = np.linalg.lstsq(np.hstack([line, wave]), signal, rcond=None)
    about = signal - line @ fit[:2]
    total = np.sum(about**2, axis=0)
    least = len(signal) * _SILENCE**2
    left = np.sum((about - wave @ fit[2:]) ** 2, axis=0)
    explained = np.divide(total - left, total, out=np.zeros_like(total), where=total > least)
    return fit[2] + 1j * fit[3], explained


Complexes = NDArray[np.complex128]

SILENCE: Final = 1e-6
"""Modulus, in SI units, below which nothing comes through: the rest is rounding, which has no phase."""


@configuration
class Sinusoid:
    """What one sinusoid gave.

    Args:
        input: The axis of :data:`~.metrics.CUE_AXES` that the car moves on.
        frequency: rad/s.
        amplitude: Of the input, m/s^2 or rad/s.
        modulus: By axis: amplitude of the simulator cue over ``amplitude``.
        phase: By axis: of the simulator cue before the reference cue on ``input``, rad, within (-pi, pi];
            None where the modulus is below :data:`SILENCE`.
        explained: Share of the simulator cue's variance on the input's own axis that is this sinusoid; 1 if
            the policy is linear, 0 where nothing comes through.
        at_limit: Share of the measured time with any actuator at any limit.
    """

    input: str
    frequency: float
    amplitude: float
    modulus: dict[str, float]
    phase: dict[str, float | None]
    explained: float
    at_limit: float


@configuration
class FrequencyResponse:
    """The response of one policy.

    Args:
        policy: Name.
        platform: Name of the motion base.
        test: How it was driven.
        sinusoids: By input axis, then frequency.
    """

    policy: str
    platform: str
    test: FrequencyTest
    sinusoids: tuple[Sinusoid, ...]

    @property
    def inputs(self) -> tuple[str, ...]:
        """Axes that were moved."""
        return tuple(dict.fromkeys(s.input for s in self.sinusoids))

    def frequencies(self, moved: str) -> Floats:
        """(n,) rad/s, of the sinusoids on an input axis."""
        return np.array([s.frequency for s in self.sinusoids if s.input == moved])

    def response(self, moved: str, simulated: str) -> Complexes:
        """(n,) complex response of an axis to an input axis, by :meth:`frequencies`; 0 in silence."""
        chosen = [(s.modulus[simulated], s.phase[simulated]) for s in self.sinusoids if s.input == moved]
        values = [0.0 if phase is None else modulus * np.exp(1j * phase) for modulus, phase in chosen]
        return np.array(values, dtype=np.complex128)


def frequency_response(
    policy: Any,
    platform: Platform,
    test: FrequencyTest | None = None,
    axes: Sequence[str] = CUE_AXES,
    progress: Callable[[float], None] = lambda frequency: None,
) -> FrequencyResponse:
    """Drive a policy with every sinusoid.

    Args:
        policy: A policy, or any object with ``predict``.
        platform: The machine.
        test: Frequencies, amplitudes, durations.
        axes: To be moved, of :data:`~.metrics.CUE_AXES`.
        progress: Called with each frequency before it is driven.
    """
    test, policy = test or FrequencyTest(), as_policy(policy).for_platform(platform)
    sinusoids: list[Sinusoid] = []
    for frequency in test.frequencies:
        progress(frequency)
        probes = [probe(axis, frequency, test) for axis in axes]
        # A network rounds sums of a batch in another way, so agents are driven one axis at a time.
        for batch in [probes] if policy.task is None else [[one] for one in probes]:
            for one, motion in zip(batch, _motions(policy, platform, batch), strict=True):
                sinusoids.append(_sinusoid(one, motion, test.amplitude(one.axis, frequency)))
    sinusoids.sort(key=lambda s: (CUE_AXES.index(s.input), s.frequency))
    return FrequencyResponse(policy.name, platform.name, test, tuple(sinusoids))


@dataclass(frozen=True, eq=False)
class _Motion:
    """Reference and simulator cue (n, 6) in the window, and whether any actuator was at a limit (n,)."""

    reference: Floats
    simulated: Floats
    limited: NDArray[np.bool_]
    dt: float


def _sinusoid(one: Probe, motion: _Motion, amplitude: float) -> Sinusoid:
    column = CUE_AXES.index(one.axis)
    reference, _ = harmonic(motion.reference, one.frequency, motion.dt)
    simulated, explained = harmonic(motion.simulated, one.frequency, motion.dt)
    ratio = simulated / reference[column]
    modulus, phase = np.abs(ratio), np.angle(ratio).tolist()
    phases = [angle if size >= SILENCE else None for size, angle in zip(modulus, phase, strict=True)]
    return Sinusoid(
        input=one.axis,
        frequency=one.frequency,
        amplitude=amplitude,
        modulus=dict(zip(CUE_AXES, modulus.tolist(), strict=True)),
        phase=dict(zip(CUE_AXES, phases, strict=True)),
        explained=float(explained[column]),
        at_limit=float(motion.limited.mean()),
    )


def _motions(policy: Policy, platform: Platform, probes: Sequence[Probe]) -> Iterator[_Motion]:
    """The motion in the window of each of some probes of one length, driven side by side."""
    run = Rollout(policy, Machines([one.cues for one in probes], [platform]))
    samples, n = probes[0].samples, len(probes)
    motion = np.zeros((2, samples, n, len(CUE_AXES)))
    limited = np.zeros((samples, n), dtype=bool)
    first = run.samples - 1 - samples
    for k, _ in enumerate(run.steps()):
        if k < first:
            continue
        state = run.simulator.state
        for i, cue in enumerate(("reference_cue", "simulator_cue")):
            motion[i, k - first] = np.hstack([state[cue]["force"], state[cue]["rate"]])
        limited[k - first] = state["limits"] != 0
    for j in range(n):
        yield _Motion(motion[0, :, j], motion[1, :, j], limited[:, j], run.simulator.dt)
