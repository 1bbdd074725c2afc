"""What the classical, the adaptive and the optimal washout have in common: kernels that act, and a start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ...envs.platform.machines import Cab
from ...envs.settings import Vector2, Vector3
from ...envs.simulator import N_AXES
from ..policy import Array
from .kernels import drive_kernel, predict_kernel


class FamilyParameters(Protocol):
    """A parameter set of any family."""

    @property
    def name(self) -> str:
        """Of the set."""
        ...

    @property
    def description(self) -> str:
        """One line for people."""
        ...

    @property
    def start_carriage(self) -> Vector2:
        """Where the carriage begins a drive, m."""
        ...

    @property
    def start_hexapod(self) -> Vector3:
        """Where the hexapod begins a drive, m from neutral."""
        ...


@dataclass(frozen=True)
class Family:
    """An algorithm of the washout kind, as kernels.

    Args:
        parameters: Kernel's struct of a parameter set.
        memory: Kernel's struct of the filters' states.
        values: (set, cab, time step in s) -> the kernel's form of a set.
        predict: Kernel from observations, see :func:`~.kernels.predict_kernel`.
        drive_through: Kernel fused with the machine, see :func:`~.kernels.drive_kernel`.
    """

    parameters: Any
    memory: Any
    values: Callable[[Any, Cab, float], Any]
    predict: Any
    drive_through: Any


def make_family(
    parameters: Any, memory: Any, begin: Any, step: Any, values: Callable[[Any, Cab, float], Any]
) -> Family:
    """A family of its structs, its first memory and its step; see :class:`Family`."""
    return Family(
        parameters,
        memory,
        values,
        predict_kernel(parameters, memory, begin, step),
        drive_kernel(parameters, begin, step),
    )


def start_pose(p: FamilyParameters) -> Array:
    """(9,) pose to begin a drive at: C'(0) and S'(0)."""
    pose = np.zeros(N_AXES)
    pose[:2], pose[2:5] = p.start_carriage, p.start_hexapod
    return pose
