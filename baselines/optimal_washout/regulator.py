"""The linear-quadratic problem behind a filter, and its solution by the algebraic Riccati equation.

Sivan, Ish-Shalom and Huang (1982), in the form of Telban and Cardullo, NASA/CR-2005-213747: the car's motion
w is white noise through first-order filters, z the states of machine and of perception, which is driven by
the difference of car and machine, u the machine's accelerations; the mean of y'Qy is as small as can be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ...envs.errors import ConfigurationError

Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StateSpace:
    """dz/dt = A z + B w, u = C z + D w."""

    a: Matrix
    b: Matrix
    c: Matrix
    d: Matrix


@dataclass(frozen=True, eq=False)
class Problem:
    """Minimise the mean of y'Qy, y = C z + D u + H w.

    dz/dt = A z + B u + E w, dw/dt = -diag(bandwidth) w + noise.

    Args:
        a: (n, n).
        b: (n, m).
        e: (n, k).
        c: (p, n).
        d: (p, m).
        h: (p, k).
        q: (p,) diagonal of Q.
        bandwidth: (k,) rad/s.
    """

    a: Matrix
    b: Matrix
    e: Matrix
    c: Matrix
    d: Matrix
    h: Matrix
    q: Matrix
    bandwidth: Matrix

    @property
    def joint(self) -> tuple[Matrix, Matrix, Matrix]:
        """A, B and C of [z, w]."""
        k = len(self.bandwidth)
        a = np.block([[self.a, self.e], [np.zeros((k, len(self.a))), -np.diag(self.bandwidth)]])
        b = np.vstack([self.b, np.zeros((k, self.b.shape[1]))])
        return a, b, np.hstack([self.c, self.h])


@dataclass(frozen=True, eq=False)
class Solution:
    """The best linear regulator.

    Args:
        riccati: P of the algebraic Riccati equation over [z, w]; [z, w]' P [z, w] is the cost yet to come.
        gain: K: u = -K [z, w].
        filter: The regulator and what it drives, as a filter of w.
    """

    riccati: Matrix
    gain: Matrix
    filter: StateSpace


def solve(problem: Problem) -> Solution:
    """The regulator that minimises the cost.

    Raises:
        ConfigurationError: the Riccati equation has no stabilising solution in floating point.
    """
    a, b, c = problem.joint
    weighted = problem.q[:, None] * c
    q, s = c.T @ weighted, weighted.T @ problem.d
    r = problem.d.T @ (problem.q[:, None] * problem.d)
    try:
        riccati = np.asarray(linalg.solve_continuous_are(a, b, q, r, s=s), dtype=np.float64)
    except (linalg.LinAlgError, ValueError) as error:
        raise ConfigurationError(
            f"no optimal washout has these weights ({error}); bring them nearer"
        ) from None
    gain = linalg.solve(r, b.T @ riccati + s.T, assume_a="pos")
    return Solution(riccati, gain, _closed(problem, gain))


def _closed(problem: Problem, gain: Matrix) -> StateSpace:
    """The loop of regulator, perception and machine, from the car's motion to the machine's accelerations."""
    n = len(problem.a)
    inner, forward = gain[:, :n], gain[:, n:]
    return StateSpace(
        problem.a - problem.b @ inner, problem.e - problem.b @ forward, -inner, -np.asarray(forward)
    )
