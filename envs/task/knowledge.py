"""Known beside the cues: the driver's controls, the car's speed and slip, and the road ahead, as rows.

:func:`known_of` makes the rows of every sample of every drive, and the kernel writes them into observations.
The real-time loop makes them of packets with :class:`KnownRows`, sample by sample.

A steering wheel means more to a policy as the turn it asks for: angle / (i L (1 + v^2 / v_ch^2)) is the
curvature of a steady turn, here of a nominal car. The road ahead means more at the present speed: v^2 kappa.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Annotated, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.signal import lfilter

from ..cues import CONTROLS, GRAVITY, CueTrace
from ..errors import ConfigurationError
from ..road import NO_STOP, SLOWEST, SPACING, Ahead
from ..settings import NonNegative, Positive, check_range, configuration
from ..simulator.kernels.observation import SCALES
from ..simulator.simulator import TIME_STEP
from .kernels.observation import CONTROL_ROWS, EACH_TIME, ROAD_ROWS, SPEED_ROWS, ObservationOptions

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Share = Annotated[float, Field(ge=0.0, le=1.0)]

TURNING: Final = 16.0 * 2.75
"""Steering ratio times wheelbase of the nominal car, m."""

CHARACTERISTIC_SPEED: Final = 25.0
"""Of the nominal car, at which its yaw gain is largest, m/s."""

QUICKNESS: Final = 0.1
"""Time constant of the rates of steering wheel and pedals, s."""

LATERAL: Final = 6.0
"""Lateral acceleration at which that of the road ahead saturates, m/s^2: drivers slow down before."""

COMFORT: Final = 3.0
"""Lateral acceleration of the bends that braking is for, m/s^2."""

SIGHT: Final = 100.0
"""Distance from which a stop is seen in ``stop_ahead``, m."""

_WALK: Final = 2.0
"""Speed up to which ``standing`` falls to 0, m/s."""


@configuration
class MapErrors:
    """Errors of what is known of the road, drawn for each drive of the library; none by default.

    Args:
        scale: Range of a factor on curvature.
        shift: Largest error of the place along the way, m.
        missing: Largest share of time in which the map is not there.
        missing_time: Mean duration of a gap, s.
        unannounced: Share of drives whose scenario says nothing of cones and stops.
        unmapped: Largest share of the way on which the map is straight, whatever is driven there: swerves.
        unmapped_length: Mean length of such a stretch, m.
        without_controls: Share of drives without steering wheel and pedals.
    """

    scale: tuple[Positive, Positive] = (1.0, 1.0)
    shift: NonNegative = 0.0
    missing: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    missing_time: Positive = 3.0
    unannounced: Share = 0.0
    unmapped: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    unmapped_length: Positive = 100.0
    without_controls: Share = 0.0

    def __post_init__(self) -> None:
        check_range("scale", self.scale)

    def drawn(self, drive: CueTrace, rng: np.random.Generator) -> CueTrace:
        """A drive as it is known with errors."""
        scale, shift = float(rng.uniform(*self.scale)), self.shift * float(rng.uniform(-1.0, 1.0))
        share, silent, blind = self.missing * float(rng.uniform()), float(rng.uniform()), float(rng.uniform())
        chance = rng.uniform(size=len(drive))
        road, channels = drive.road, dict(drive.channels)
        if road is not None:
            road = road.wrong(scale, shift).missing(_gaps(chance, share, self.missing_time, drive.dt))
            road = road.unannounced() if silent < self.unannounced else road
            if self.unmapped > 0.0:
                share, chance = self.unmapped * float(rng.uniform()), rng.uniform(size=len(road.curvature))
                road = road.unmapped(_gaps(chance, share, self.unmapped_length, SPACING))
        if blind < self.without_controls:
            channels = {name: values for name, values in channels.items() if name not in _WHEEL_AND_PEDALS}
        return dataclasses.replace(drive, road=road, channels=channels)


_WHEEL_AND_PEDALS: Final = CONTROLS[:3]
_KNOWLEDGE_STREAM: Final = 5


def _gaps(chance: Floats, share: float, duration: float, dt: float) -> Flags:
    """(n,) whether the map is wrong: a chain of two states with a share of time and a mean duration."""
    recover = min(dt / duration, 1.0)
    fail = min(recover * share / (1.0 - share), 1.0)
    missing, out = np.zeros(len(chance), dtype=bool), False
    for k, number in enumerate(chance.tolist()):
        out = number >= recover if out else number < fail
        missing[k] = out
    return missing


class Controls(NamedTuple):
    """Controls of the driver and state of the car at n samples.

    Args:
        wheel: (n,) angle of the steering wheel, rad, positive to the right.
        throttle: (n,) share.
        brake: (n,) share.
        speed: (n,) m/s.
        slip: (n,) side slip, rad.
        known: (n,) whether wheel and pedals are known.
    """

    wheel: Floats
    throttle: Floats
    brake: Floats
    speed: Floats
    slip: Floats
    known: Flags


def controls_of(drive: CueTrace) -> Controls:
    """The controls of a drive; 0 for channels that it does not have.

    Raises:
        ConfigurationError: it does not even have a speed.
    """
    if "speed_m_s" not in drive.channels:
        raise ConfigurationError(
            f"{drive.name}: the drive has no channel speed_m_s, which a policy with observation.controls or "
            "observation.road needs"
        )
    zero, speed = np.zeros(len(drive)), drive.channels["speed_m_s"]
    wheel, throttle, brake = (drive.channels.get(name, zero) for name in _WHEEL_AND_PEDALS)
    sideways = drive.channels.get("lateral_speed_m_s", zero)
    known = all(name in drive.channels for name in _WHEEL_AND_PEDALS)
    slip = np.arctan2(sideways, np.maximum(speed, 1.0))
    return Controls(wheel, throttle, brake, speed, slip, np.full(len(drive), known))


class KnownRows:
    """Rows of an observation that are made of controls and road, in the scales of their declarations.

    Args:
        options: What is seen.

    Attributes:
        size: Entries.
        times: (t,) ahead at which the road is seen, s.
    """

    def __init__(self, options: ObservationOptions) -> None:
        self._options = options
        self.times = np.array(options.road, dtype=np.float64)
        rows = [*(CONTROL_ROWS if options.controls else ()), *(SPEED_ROWS if options.knows else ())]
        sizes = [row.size for row in rows]
        if options.road:
            rows += ROAD_ROWS
            sizes += [len(options.road)] * EACH_TIME + [row.size for row in ROAD_ROWS[EACH_TIME:]]
        self.size = sum(sizes)
        self._scale = np.repeat([row.scale for row in rows], sizes)
        self._pole = float(np.exp(-TIME_STEP / QUICKNESS))

    def distances(self, speed: Floats) -> Floats:
        """(n, times) at which the road is seen, m, for speeds (n,), m/s."""
        return np.asarray(np.maximum(speed, SLOWEST)[:, None] * self.times)

    def __call__(
        self, controls: Controls, ahead: Ahead | None, mapped: Flags, smooth: Floats | None = None
    ) -> tuple[Floats, Floats]:
        """The rows (n, size) of n samples that follow each other, and the state after them.

        Args:
            controls: At the samples.
            ahead: The road there, at :meth:`distances`; None for no road.
            mapped: (n,) whether the map is there.
            smooth: (3,) state before: wheel and pedals through :data:`QUICKNESS`; None at the begin of a
                drive.
        """
        signals = np.column_stack((controls.wheel, controls.throttle, controls.brake))
        before = signals[0] if smooth is None else smooth
        filtered, after = lfilter(
            [1.0 - self._pole], [1.0, -self._pole], signals, axis=0, zi=self._pole * before[None, :]
        )
        columns: list[Floats] = []
        if self._options.controls:
            columns += self._controls(controls, signals, (signals - filtered) / QUICKNESS)
        if self._options.knows:
            columns += [controls.speed, np.clip(1.0 - controls.speed / _WALK, 0.0, 1.0)]
        if self._options.road:
            columns += self._road(controls.speed, ahead, mapped)
        rows = np.column_stack(columns) if columns else np.zeros((len(signals), 0))
        return rows / self._scale, after[0] / self._pole

    def _controls(self, controls: Controls, signals: Floats, rates: Floats) -> list[Floats]:
        speed, known = controls.speed, controls.known.astype(np.float64)
        curvature = controls.wheel / (TURNING * (1.0 + (speed / CHARACTERISTIC_SPEED) ** 2))
        columns = [
            controls.wheel,
            rates[:, 0],
            speed * curvature,
            speed**2 * curvature,
            signals[:, 1:],
            rates[:, 1:],
            controls.slip,
        ]
        return [*((column.T * known).T for column in columns), known]

    def _road(self, speed: Floats, ahead: Ahead | None, mapped: Flags) -> list[Floats]:
        times = len(self.times)
        if ahead is None:
            size = EACH_TIME * times + sum(row.size for row in ROAD_ROWS[EACH_TIME:])
            return [np.zeros((len(speed), size))]
        distance, v = self.distances(speed), speed[:, None]
        force = v**2 * ahead.curvature
        allowed = np.minimum(COMFORT / np.maximum(np.abs(ahead.curvature), 1e-6), 1e6)
        lower = np.minimum(ahead.speed_limit, 1e3) ** 2
        stop = np.maximum(ahead.stop_distance, 0.0)
        seen = stop < NO_STOP
        braking = np.column_stack(
            (
                np.where(seen, 0.5 * speed**2 / np.maximum(stop, 1.0), 0.0),
                np.max(np.maximum(v**2 - allowed, 0.0) / (2.0 * distance), axis=1),
                np.max(np.maximum(v**2 - lower, 0.0) / (2.0 * distance), axis=1),
            )
        )
        columns = [
            force / np.sqrt(1.0 + (force / LATERAL) ** 2),
            ahead.curvature,
            ahead.grade,
            ahead.bank,
            ahead.speed_limit - v,
            np.minimum(braking, 10.0),
            np.where(seen, np.clip(1.0 - stop / SIGHT, 0.0, 1.0), 0.0),
            np.ones(len(speed)),
        ]
        there = mapped.astype(np.float64)
        return [(column.T * there).T for column in columns]


def known_of(
    drives: Sequence[CueTrace], options: ObservationOptions, errors: MapErrors, seed: int
) -> NDArray[np.float32]:
    """(samples of all drives, size) rows of controls and road, scaled as the observation's.

    Args:
        drives: Of a library.
        options: What is seen.
        errors: Of what is known.
        seed: Of the library.

    Raises:
        ConfigurationError: a drive has no controls or no road, and ``allow_missing`` is off.
    """
    if not options.knows:
        return np.zeros((sum(map(len, drives)), 0), dtype=np.float32)
    rows = []
    for number, drive in enumerate(drives):
        if errors != MapErrors():
            drive = errors.drawn(drive, np.random.default_rng((seed, _KNOWLEDGE_STREAM, number)))
        elif not options.allow_missing:
            refuse_unknown(drive, options)
        rows.append(_of_drive(drive, options))
    return np.concatenate(rows).astype(np.float32)


def refuse_unknown(drive: CueTrace, options: ObservationOptions) -> None:
    """Refuse a drive without what is seen.

    Raises:
        ConfigurationError: it has no controls or no road.
    """
    missing = [name for name in _WHEEL_AND_PEDALS if name not in drive.channels] if options.controls else []
    if missing:
        raise ConfigurationError(
            f"{drive.name}: the drive has no channel {', '.join(missing)}, which a policy with "
            "observation.controls needs; set observation.allow_missing, or leave the drive out"
        )
    if options.road and drive.road is None:
        raise ConfigurationError(
            f"{drive.name}: the drive has no road, which a policy with observation.road needs; set "
            "observation.allow_missing, or leave the drive out"
        )


def _of_drive(drive: CueTrace, options: ObservationOptions) -> Floats:
    make, controls = KnownRows(options), controls_of(drive)
    nowhere = np.zeros(len(drive), dtype=bool)
    if drive.road is None or not options.road:
        return make(controls, None, nowhere)[0]
    return make(controls, drive.road.ahead(make.distances(controls.speed)), drive.road.known)[0]


def preview_times(options: ObservationOptions) -> Floats:
    """(preview,) times ahead of the samples of a preview, s."""
    stride = max(1, round(options.preview_spacing / TIME_STEP))
    return np.asarray(TIME_STEP * stride * np.arange(1, options.preview + 1), dtype=np.float64)


def expected_of(drives: Sequence[CueTrace], options: ObservationOptions) -> NDArray[np.float32]:
    """(samples of all drives, 6 per sample of the preview) expected cues, scaled as the observation's.

    It has no columns where the preview is the true one.

    Raises:
        ConfigurationError: some of the drives carry expected cues, others do not.
    """
    carried = [drive.expected is not None for drive in drives]
    if not options.preview or not any(carried):
        return np.zeros((sum(map(len, drives)), 0), dtype=np.float32)
    if not all(carried):
        raise ConfigurationError("all drives must carry expected cues, or none")
    times = preview_times(options)
    rest = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
    scale = np.repeat([SCALES["reference_force"], SCALES["reference_rate"]], 3)
    rows = []
    for drive in drives:
        assert drive.expected is not None
        now = np.hstack((drive.specific_force, drive.angular_velocity))
        rows.append(((drive.expected.at(now, times) - rest) / scale).reshape(len(drive), -1))
    return np.concatenate(rows).astype(np.float32)
