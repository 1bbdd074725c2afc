"""How drivers differ: ranges from which the driver of each random drive is drawn."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from ..car.kernels.driver import Driver
from ..car.plans import STEP
from ..settings import NonNegative, Positive, check_range, configuration
from .roads import Style

Floats = NDArray[np.float64]
PositiveRange = tuple[Positive, Positive]
Spread = tuple[NonNegative, NonNegative]


FARTHER: Final = 2.0
"""How much farther ahead a driver looks who reacts later, s/s: keeps the steering damped."""


@configuration
class Drivers:
    """Ranges of what makes a driver; each is drawn for each drive. The default is the standard driver.

    People keep their lane with a standard deviation of 0.2 to 0.3 m (SDLP of sober drivers in road tests
    after O'Hanlon, from memory) and their speed with one of 2 to 4 km/h (from memory); the delay of steering
    is 0.15 to 0.3 s (crossover model, McRuer, from memory).

    Args:
        preview_time: Time to the point aimed at, s, beyond :data:`FARTHER` times the reaction's delay.
        anticipation: How far ahead curvature is steered, beyond the reaction's delay, s.
        reaction_delay: From seeing to steering, s.
        lane_wander: Standard deviation of the line aimed at, m.
        wander_time: Its correlation time, s.
        steering_noise: Standard deviation of errors of the steering wheel, rad.
        pedal_noise: Standard deviation of errors of the requested acceleration, m/s^2.
        shift_pace: Factor on the time of a manual shift.
        catch_up: Largest acceleration to make up for being late, m/s^2; 0 for no bound.
        patience: How far the plan may get ahead of the car before it waits, m; 0 for a plan that never does.
        pace: Factor on the speed limits.
        speed_wander: Standard deviation of the speed chosen, as a share of the limit.
        accelerating: Factor on the kind's accelerations.
        braking: Factor on its decelerations.
        cornering: Factor on its centripetal accelerations.
        smoothness: Factor on the time over which speed changes are smoothed.
    """

    preview_time: PositiveRange = (0.8, 0.8)
    anticipation: Spread = (0.2, 0.2)
    reaction_delay: Spread = (0.0, 0.0)
    lane_wander: Spread = (0.0, 0.0)
    wander_time: PositiveRange = (3.0, 3.0)
    steering_noise: Spread = (0.0, 0.0)
    pedal_noise: Spread = (0.0, 0.0)
    shift_pace: PositiveRange = (1.0, 1.0)
    catch_up: Spread = (0.0, 0.0)
    patience: Spread = (0.0, 0.0)
    pace: PositiveRange = (1.0, 1.0)
    speed_wander: Spread = (0.0, 0.0)
    accelerating: PositiveRange = (1.0, 1.0)
    braking: PositiveRange = (1.0, 1.0)
    cornering: PositiveRange = (1.0, 1.0)
    smoothness: PositiveRange = (1.0, 1.0)

    def __post_init__(self) -> None:
        for item in dataclasses.fields(self):
            check_range(item.name, getattr(self, item.name))

    def drawn(self, rng: np.random.Generator) -> DrawnDriver:
        """One of these drivers."""
        values = {
            item.name: float(rng.uniform(*getattr(self, item.name))) for item in dataclasses.fields(self)
        }
        own = {item.name for item in dataclasses.fields(Driver)}
        values["anticipation"] += values["reaction_delay"]
        values["preview_time"] += FARTHER * values["reaction_delay"]
        driver = Driver(**{name: value for name, value in values.items() if name in own})
        return DrawnDriver(driver, **{name: value for name, value in values.items() if name not in own})


@dataclass(frozen=True)
class DrawnDriver:
    """A driver, and how fast and how briskly this one goes; the fields are those of :class:`Drivers`."""

    driver: Driver
    pace: float
    speed_wander: float
    accelerating: float
    braking: float
    cornering: float
    smoothness: float

    @property
    def haste(self) -> float:
        """Factor on the time that a road takes, at least: below 1 for who drives faster than its limits."""
        return 1.0 if self.pace <= 1.0 and self.speed_wander == 0.0 else 1.0 / (self.pace * 1.5)

    def style(self, style: Style) -> Style:
        """The style of a kind of road as this driver has it."""
        return Style(
            self.accelerating * style.accelerate, self.braking * style.brake, self.cornering * style.lateral
        )

    def chosen_speed(self, limit: Floats, rng: np.random.Generator) -> Floats:
        """The speed that this driver takes the limit for, (n,) m/s, one a point of a path."""
        noise = self.speed_wander * _drifting(rng, len(limit))
        return np.asarray(self.pace * limit * np.clip(1.0 + noise, 0.5, 1.5))


STANDARD: DrawnDriver = Drivers().drawn(np.random.default_rng(0))
"""The standard driver."""

_DRIFT = 150.0
"""Way along which the chosen speed drifts, m."""


def _drifting(rng: np.random.Generator, points: int) -> Floats:
    """Noise of unit variance through two low-passes of :data:`_DRIFT` along a path, from 0 on."""
    decay = np.exp(-STEP / _DRIFT)
    power = (1.0 - decay) ** 4 * (1.0 + decay**2) / (1.0 - decay**2) ** 3
    noise = lfilter([(1.0 - decay) ** 2], [1.0, -2.0 * decay, decay**2], rng.normal(size=points))
    return np.asarray(noise / np.sqrt(power))
