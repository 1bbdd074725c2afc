"""Policies on the classical washout: gain scheduling by an agent, and the best set for each maneuver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import warp as wp

from ....envs.cues import CueTrace
from ....envs.errors import ActionError, ConfigurationError, DataError, UnknownNameError
from ....envs.platform.machines import Cab, Platform
from ....envs.settings import configuration, preset_names
from ....envs.simulator.kernels.observation import OBSERVATION_SIZE
from ....envs.simulator.simulator import TIME_STEP
from ...policy import WHOLE_DRIVE, Array, Policy, checked_observation
from ..kernels.blocks import Parameters
from .family import ClassicalWashout, WashoutParameters, kernel_parameters, load_washout

KNOBS: Final[Mapping[str, tuple[str, ...]]] = {
    "cue_scale": ("force_scale", "rate_scale"),
    "hpr": ("hpr_roll.frequency", "hpr_pitch.frequency", "hpr_yaw.frequency"),
    "tilt_low_pass": ("tilt_frequency",),
    "hps": ("hps_x.frequency", "hps_y.frequency"),
    "hpi": ("hpi_x.frequency", "hpi_y.frequency", "hpi_z.frequency"),
    "lpc": ("lpc_frequency",),
}
"""Each gain's name, and the parameters of the kernel that it multiplies."""


class ScheduledWashout(ClassicalWashout):
    """A washout whose cue scale and break frequencies an agent turns, each between 1 / span and span times.

    Args:
        parameters: A parameter set, a preset name or a YAML file, default the set by hand: where all gains
            are 0.
        cab: Where the driver sits on the machine.
        dt: Time step, s.
        span: Largest factor, at a gain of 1.

    Raises:
        ConfigurationError: ``span`` is not above 1.
    """

    def __init__(
        self,
        parameters: WashoutParameters | str | Path | None = None,
        cab: Cab | None = None,
        dt: float = TIME_STEP,
        span: float = 2.0,
    ) -> None:
        if not span > 1.0:
            raise ConfigurationError(f"span must be above 1, found {span}")
        self._tables: dict[int, Any] = {}
        super().__init__(parameters, cab, dt)
        self.span = span
        self._neutral = self._kernel_parameters.numpy().copy()

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles are made anew: Warp's arrays cannot be."""
        return type(self), (self.parameters, self.cab, self.time_step, self.span)

    @property
    def gain_names(self) -> tuple[str, ...]:
        """What each gain turns."""
        return tuple(KNOBS)

    def schedule(
        self, observation: Array, gains: Array, state: Any = None, episode_start: Array | None = None
    ) -> tuple[Array, Any]:
        """Accelerations (n, 9) for observations (n, OBSERVATION_SIZE) with gains (n, k) in [-1, 1].

        Raises:
            ActionError: the gains are not numbers, have the wrong shape, or are not finite.
            DataError: another argument has the wrong type or shape, or the observation is not finite.
        """
        observation = checked_observation(observation)
        if observation.ndim != 2:
            raise DataError(f"observation has shape {observation.shape}, expected (n, {OBSERVATION_SIZE})")
        n = len(observation)
        gains = _checked_gains(gains, n)
        if n not in self._buffers:
            self._make_buffers(n)
        self._turn(self._tables[n], self.span**gains)
        try:
            return self.predict(observation, state, episode_start)
        finally:
            # A refused argument must not leave the gains behind for the next plain predict.
            self._turn(self._tables[n], np.ones_like(gains))

    def _turn(self, table: Array, factors: Array) -> None:
        """Write the parameters of every environment, ``factors`` (n, k) times the neutral ones."""
        for k, names in enumerate(KNOBS.values()):
            for name in names:
                field, *inner = name.split(".")
                target, neutral = table[field], self._neutral[field]
                if inner:
                    target, neutral = target[inner[0]], neutral[inner[0]]
                factor = factors[:, k].reshape(-1, *[1] * (target.ndim - 1))
                target[...] = neutral * factor

    def _make_buffers(self, n: int) -> Any:
        values = [kernel_parameters(self.parameters, self.cab)] * n
        parameters = wp.array(values, dtype=Parameters, device="cpu")
        self._tables[n] = parameters.numpy()
        return self._buffers_with(n, parameters, wp.array(np.arange(n), dtype=int, device="cpu"))


def _checked_gains(gains: Array, n: int) -> Array:
    shape = (n, len(KNOBS))
    try:
        values = np.asarray(gains, dtype=np.float64)
    except (TypeError, ValueError):
        raise ActionError(f"gains are not numeric; give an array of {shape} numbers in [-1, 1]") from None
    if values.shape != shape or not np.isfinite(values).all():
        raise ActionError(f"gains must be finite and of shape {shape}, found {values.shape}")
    return values


PER_MANEUVER: Final = "classical-per-maneuver"
_SETS: Final = Path(__file__).parent / "presets" / "per-maneuver"


@configuration
class PerManeuverParameters:
    """Parameter sets by maneuver."""

    sets: dict[str, WashoutParameters]


def tuned_maneuvers() -> list[str]:
    """Names of the maneuvers that have a parameter set."""
    return preset_names(_SETS)


def load_per_maneuver(maneuver: str) -> WashoutParameters:
    """The best parameter set for a maneuver.

    Raises:
        UnknownNameError: there is none.
    """
    if maneuver not in tuned_maneuvers():
        raise UnknownNameError(f"maneuver of {PER_MANEUVER}", maneuver, tuned_maneuvers())
    return load_washout(_SETS / f"{maneuver}.yaml")


class PerManeuverWashout(Policy):
    """The classical washout with the best parameter set for the maneuver at hand.

    Without a turntable it yaws the cab with the hexapod (k_T = 0), as the paper's EST3: the sets are tuned on
    a machine with one.

    Args:
        platform: The machine.
        dt: Time step, s.
    """

    name = PER_MANEUVER
    information = WHOLE_DRIVE

    def __init__(self, platform: Platform, dt: float = TIME_STEP) -> None:
        self.platform: Platform = platform
        self.time_step: float = dt
        sets = {name: load_per_maneuver(name) for name in tuned_maneuvers()}
        if platform.turntable is None:
            sets = {name: replace(tuned, turntable_share=0.0) for name, tuned in sets.items()}
        self.parameters: PerManeuverParameters = PerManeuverParameters(sets)

    def for_drive(self, cues: CueTrace) -> Policy:
        """The washout for a maneuver, by the name of its cues.

        Raises:
            UnknownNameError: no set has been tuned for it.
        """
        sets = self.parameters.sets
        if cues.name not in sets:
            raise UnknownNameError(f"maneuver of {PER_MANEUVER}", cues.name, sets)
        return ClassicalWashout(replace(sets[cues.name], name=self.name), self.platform.cab, self.time_step)
