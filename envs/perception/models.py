"""Published models of the human vestibular system, and their exact discretization.

Semicircular canals sense angular velocity, otoliths specific force, each axis by itself, in the head
frame F_P. Otolith outputs are divided by the model's static gain (0.4), so both signals carry the unit of
what they sense and can be held beside the truth.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from ..registry import Registry
from ..settings import NonNegative, Positive, Vector3, configuration


@configuration
class Canals:
    """Semicircular canals: T_L T_a s^2 (1 + T_lead s) / ((T_L s + 1) (T_s s + 1) (T_a s + 1)).

    Args:
        long: T_L for roll, pitch and yaw, s.
        short: T_s, s.
        adaptation: T_a, s.
        lead: T_lead, s.
    """

    long: Vector3
    short: Positive
    adaptation: Positive
    lead: NonNegative = 0.0

    def transfer_function(self, axis: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Numerator and denominator in s of one axis (0 roll, 1 pitch, 2 yaw)."""
        t_long = self.long[axis]
        gain = t_long * self.adaptation
        numerator = [gain * self.lead, gain, 0.0, 0.0] if self.lead else [gain, 0.0, 0.0]
        slow = np.polymul([t_long, 1.0], [self.adaptation, 1.0])
        return np.array(numerator), np.asarray(np.polymul(slow, [self.short, 1.0]), dtype=np.float64)


@configuration
class Otoliths:
    """Otoliths: gain (T_lead s + 1) / ((T_L s + 1) (T_s s + 1)); the same on every axis.

    Args:
        lead: T_lead, s.
        long: T_L, s.
        short: T_s, s.
        gain: Static gain of the published model; divided out of the output.
    """

    lead: Positive
    long: Positive
    short: Positive
    gain: Positive = 0.4

    def transfer_function(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Numerator and denominator in s, of unit static gain."""
        denominator = np.polymul([self.long, 1.0], [self.short, 1.0])
        return np.array([self.lead, 1.0]), np.asarray(denominator, dtype=np.float64)


@configuration
class VestibularModel:
    """Canals and otoliths of one published set.

    Args:
        name: How the set is selected.
        canals: Angular velocity.
        otoliths: Specific force.
        source: Where it was published.
    """

    name: str
    canals: Canals
    otoliths: Otoliths
    source: str


_MODELS: Final[Registry[VestibularModel]] = Registry("vestibular model", "motion_cueing.vestibular_models")

for _model in (
    VestibularModel(
        name="zacharias",
        canals=Canals(long=(6.1, 5.3, 10.2), short=0.1, adaptation=30.0),
        otoliths=Otoliths(lead=13.2, long=5.33, short=0.66),
        source="canals: Zacharias, in the form of Reid and Nahon; otoliths: Young and Meiry",
    ),
    VestibularModel(
        name="telban",
        canals=Canals(long=(5.73, 5.73, 5.73), short=0.005, adaptation=80.0, lead=0.06),
        otoliths=Otoliths(lead=10.0, long=5.0, short=0.016),
        source="Telban and Cardullo, NASA/CR-2005-213747",
    ),
):
    _MODELS.register(_model.name, _model, _model.source)


register = _MODELS.register
"""Give a perception model a name, see :meth:`~motion_cueing.envs.registry.Registry.register`."""


def vestibular_model_names() -> list[str]:
    """Names :func:`get_vestibular_model` knows."""
    return sorted(_MODELS)


def get_vestibular_model(name: str) -> VestibularModel:
    """A published parameter set by name.

    Raises:
        UnknownNameError: no set has this name.
    """
    return _MODELS[name]


@dataclass(frozen=True)
class DiscreteFilter:
    """x' = A x + B u, y = C x + D u, of third order; lower orders are padded with zeros.

    Args:
        a: (3, 3).
        b: (3,).
        c: (3,).
        d: Feedthrough.
        rest: (3,) state at which a unit constant input has been applied for ever.
    """

    a: NDArray[np.float64]
    b: NDArray[np.float64]
    c: NDArray[np.float64]
    d: float
    rest: NDArray[np.float64]


def discretize(numerator: NDArray[np.float64], denominator: NDArray[np.float64], dt: float) -> DiscreteFilter:
    """A transfer function sampled exactly for inputs that are straight between samples."""
    system = signal.cont2discrete(signal.tf2ss(numerator, denominator), dt, method="foh")
    order = system[0].shape[0]
    a, b, c = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    a[:order, :order], b[:order], c[:order] = system[0], system[1][:, 0], system[2][0]
    rest = np.zeros(3)
    rest[:order] = np.linalg.solve(np.eye(order) - a[:order, :order], b[:order])
    return DiscreteFilter(a, b, c, float(system[3][0, 0]), rest)
