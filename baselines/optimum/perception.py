"""The driver's vestibular system as one linear filter of the error of the cues.

Canals and otoliths are linear, so what is sensed of the simulator less what is sensed of the car is what
they would sense of the difference of both. Its order is that of the published models: two for each otolith,
three for each canal, as ``envs.perception.models`` discretises them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, solve_discrete_lyapunov

from ...envs.perception import VestibularModel
from ...envs.perception.models import DiscreteFilter, discretise

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SensedError:
    """x' = A x + B e, y = C x + D e for the error e (6,) of force and rate; each signal has its own states.

    Args:
        a: (m, m).
        b: (m, 6).
        c: (6, m).
        d: (6,) feedthrough.
        size: (m,) what one unit of each state stands for in the published filter's own.
        place: (m,) where each state lies in rows of three, one row a signal, as the machine keeps them.
    """

    a: Floats
    b: Floats
    c: Floats
    d: Floats
    size: Floats
    place: NDArray[np.int64]

    def ahead(self, filters: Floats, error: Floats) -> Floats:
        """(m,) the states for the next sample.

        Args:
            filters: (6, 3) states of the published filters now, otoliths before canals.
            error: (6,) the error now.
        """
        return np.asarray(self.a @ (filters.ravel()[self.place] / self.size) + self.b @ error)


def sensed_error(model: VestibularModel, dt: float) -> SensedError:
    """The filter at a time step, s; its states are scaled to unit size under white noise."""
    otolith = discretise(*model.otoliths.transfer_function(), dt)
    canals = [discretise(*model.canals.transfer_function(axis), dt) for axis in range(3)]
    parts = [_scaled(part) for part in [otolith] * 3 + canals]
    a, b, c = (np.asarray(block_diag(*(part[i] for part in parts))) for i in range(3))
    sizes = [part[3] for part in parts]
    place = np.concatenate([3 * i + np.arange(len(size)) for i, size in enumerate(sizes)])
    d = np.array([part.d for part in [otolith] * 3 + canals])
    return SensedError(a, b, c, d, np.concatenate(sizes), place)


def _scaled(part: DiscreteFilter) -> tuple[Floats, Floats, Floats, Floats]:
    """A (m, m), B (m, 1), C (1, m) without padding, and the size (m,) of states they are in."""
    m = int(np.count_nonzero(np.any(part.a != 0.0, axis=1)))
    a, b, c = part.a[:m, :m], part.b[:m, None], part.c[None, :m]
    size = np.sqrt(np.diag(solve_discrete_lyapunov(a, b @ b.T)))
    return a * size / size[:, None], b / size[:, None], c * size, size
