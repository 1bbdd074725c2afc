"""Canals and otoliths by partial fractions: three first-order modes an axis."""

from __future__ import annotations

import numpy as np
from scipy import signal

from motion_cueing.envs.perception import VestibularModel

from .frames import Floats


class VestibularReference:
    """Exact for signals that are straight lines between samples.

    Six channels (f x, y, z; omega x, y, z) of three modes: x' = p x + u, y = sum r x + D u.
    """

    def __init__(self, model: VestibularModel, dt: float) -> None:
        pairs = [otolith_transfer(model)] * 3 + [canal_transfer(model, axis) for axis in range(3)]
        self.residues, self.poles, self.direct = np.zeros((6, 3)), np.full((6, 3), -1.0), np.zeros(6)
        for i, (numerator, denominator) in enumerate(pairs):
            residues, poles, direct = signal.residue(numerator, denominator)
            self.residues[i, : len(poles)], self.poles[i, : len(poles)] = residues.real, poles.real
            self.direct[i] = float(np.sum(direct))
        p = self.poles
        self.keep = np.exp(p * dt)
        # Integral of exp(p (dt - t)) against the two straight-line basis functions 1 - t / dt and t / dt.
        whole = np.expm1(p * dt) / p
        self.new = (whole - dt) / (p * dt)
        self.old = whole - self.new

    def rest(self, signals: Floats) -> Floats:
        """(n, 6, 3) modes after constant signals (n, 6) for ever."""
        return np.asarray(-signals[..., None] / self.poles)

    def advance(self, modes: Floats, now: Floats, then: Floats) -> Floats:
        """Modes one sample later; ``now`` and ``then`` (n, 6) are the signals at both ends."""
        return np.asarray(self.keep * modes + self.old * now[..., None] + self.new * then[..., None])

    def sensed(self, modes: Floats, signals: Floats) -> Floats:
        """(n, 6) what is sensed."""
        return np.asarray((self.residues * modes).sum(axis=-1) + self.direct * signals)


def otolith_transfer(model: VestibularModel) -> tuple[Floats, Floats]:
    """(T_lead s + 1) / ((T_L s + 1)(T_s s + 1))."""
    o = model.otoliths
    return np.array([o.lead, 1.0]), np.convolve([o.long, 1.0], [o.short, 1.0])


def canal_transfer(model: VestibularModel, axis: int) -> tuple[Floats, Floats]:
    """T_L T_a s^2 (1 + T_lead s) / ((T_L s + 1)(T_s s + 1)(T_a s + 1))."""
    c = model.canals
    gain = c.long[axis] * c.adaptation
    numerator = [gain * c.lead, gain, 0.0, 0.0] if c.lead else [gain, 0.0, 0.0]
    slow = np.convolve([c.long[axis], 1.0], [c.adaptation, 1.0])
    return np.array(numerator), np.convolve(slow, [c.short, 1.0])
