"""The frequency response of a policy on its machine: the objective motion cueing test of ICAO 9625.

Each axis of the car's motion is moved alone, in sinusoids; modulus and phase of what the driver feels, on
each axis, over what he should feel are the response. A policy that is not linear has one for each amplitude.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..baselines import ForeknowingPolicy, Policy
from ..baselines.policy import start_of
from ..envs.platform import Platform
from ..envs.settings import configuration
from ..envs.simulator import Simulator
from .drivers import Observer, TaskPolicy
from .frequency_probe import FrequencyTest, Probe, harmonic, probe
from .metrics import CUE_AXES, cab_motion
from .rollout import AnyPolicy, rollout
from .trajectory import Floats

Complexes = NDArray[np.complex128]

SILENCE: Final = 1e-6
"""Modulus, in SI units, below which nothing comes through: what is left is rounding, which has no phase."""


@configuration
class Sinusoid:
    """What one sinusoid gave.

    Args:
        input: The axis of :data:`~.metrics.CUE_AXES` that the car moves on.
        frequency: rad/s.
        amplitude: Of the input, m/s^2 or rad/s.
        modulus: By axis: amplitude of what is felt over ``amplitude``.
        phase: By axis: of what is felt before what is wanted on ``input``, rad, within (-pi, pi]; None where
            the modulus is below :data:`SILENCE`.
        explained: Share of the variance felt on the input's own axis that is this sinusoid; 1 if the policy
            is linear, 0 where nothing is felt.
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

    def response(self, moved: str, felt: str) -> Complexes:
        """(n,) complex response of an axis to an input axis, by :meth:`frequencies`; 0 in silence."""
        chosen = [(s.modulus[felt], s.phase[felt]) for s in self.sinusoids if s.input == moved]
        found = [0.0 if phase is None else modulus * np.exp(1j * phase) for modulus, phase in chosen]
        return np.array(found, dtype=np.complex128)


def frequency_response(
    policy: AnyPolicy,
    platform: Platform,
    test: FrequencyTest | None = None,
    axes: Sequence[str] = CUE_AXES,
    progress: Callable[[float], None] = lambda frequency: None,
) -> FrequencyResponse:
    """Drive a policy with every sinusoid.

    Args:
        policy: The policy; if it only has ``predict``, the axes of a frequency are driven as one batch.
        platform: The machine.
        test: Frequencies, amplitudes, durations.
        axes: To be moved, of :data:`~.metrics.CUE_AXES`.
        progress: Told each frequency before it is driven.
    """
    test = test or FrequencyTest()
    found: list[Sinusoid] = []
    for frequency in test.frequencies:
        progress(frequency)
        probes = [probe(axis, frequency, test) for axis in axes]
        for one, motion in zip(probes, _motions(policy, platform, probes), strict=True):
            found.append(_sinusoid(one, motion, test.amplitude(one.axis, frequency)))
    found.sort(key=lambda s: (CUE_AXES.index(s.input), s.frequency))
    name = str(getattr(policy, "name", type(policy).__name__))
    return FrequencyResponse(name, platform.name, test, tuple(found))


@dataclass(frozen=True, eq=False)
class _Motion:
    """Wanted and felt motion (n, 6) of the window, and whether any actuator was at a limit (n,)."""

    wanted: Floats
    felt: Floats
    limited: NDArray[np.bool_]
    dt: float


def _sinusoid(one: Probe, motion: _Motion, amplitude: float) -> Sinusoid:
    column = CUE_AXES.index(one.axis)
    wanted, _ = harmonic(motion.wanted, one.frequency, motion.dt)
    felt, explained = harmonic(motion.felt, one.frequency, motion.dt)
    ratio = felt / wanted[column]
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


def _motions(policy: AnyPolicy, platform: Platform, probes: Sequence[Probe]) -> Iterator[_Motion]:
    """The motion in the window of each of some probes of one length."""
    if isinstance(policy, ForeknowingPolicy | TaskPolicy):
        for one in probes:
            yield _single(policy, platform, one)
        return
    yield from _batch(policy, platform, probes)


def _single(policy: AnyPolicy, platform: Platform, one: Probe) -> _Motion:
    drive = rollout(policy, one.cues, platform)
    wanted, felt = cab_motion(drive)
    window = slice(-one.samples, None)
    limited = np.any(drive.limits_active != 0, axis=1)
    return _Motion(wanted[window], felt[window], limited[window], drive.dt)


def _batch(policy: Policy, platform: Platform, probes: Sequence[Probe]) -> Iterator[_Motion]:
    simulator = Simulator(platform, [one.cues for one in probes])
    observe = Observer(simulator)
    simulator.reset(start_of(policy))
    steps, samples = len(probes[0].cues) - 1, probes[0].samples
    motion = np.zeros((2, samples, len(probes), len(CUE_AXES)))
    limited = np.zeros((samples, len(probes)), dtype=bool)
    memory: Any = None
    begins = np.ones(len(probes), dtype=bool)
    for k in range(steps):
        action, memory = policy.predict(observe(), memory, begins, deterministic=True)
        state = simulator.step(action)
        begins = np.zeros(len(probes), dtype=bool)
        row = k - (steps - samples)
        if row >= 0:
            for i, cue in enumerate(("wanted", "felt")):
                motion[i, row] = np.hstack([state[cue]["force"], state[cue]["rate"]])
            limited[row] = state["limits"] != 0
    for j in range(len(probes)):
        yield _Motion(motion[0, :, j], motion[1, :, j], limited[:, j], simulator.dt)
