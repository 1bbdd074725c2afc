"""The paper's equations on the recorded motion of a machine, in NumPy and SciPy: nothing of the kernels.

The cues that the motion gives, and the motion that the washout's filters request. Statements compare both
with the recorded drive.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from ...baselines.washout.classical.family import HighPass, WashoutParameters
from ...envs.cues import GRAVITY
from ...envs.platform.kinematics import rotation, turning_axes
from ...envs.platform.machines import Cab
from ..trajectory import Floats, Trajectory

_G = np.array([0.0, 0.0, GRAVITY])


def _times(matrices: Floats, vectors: Floats) -> Floats:
    return np.asarray(np.einsum("nij,nj->ni", matrices, vectors))


@dataclass(frozen=True)
class Motion:
    """The cab's motion over a drive.

    Args:
        dt: Time step, s.
        to_inertial: (n, 3, 3) L_IS, Eq. (4).
        from_rates: (n, 3, 3) R_S, Eq. (9): angular velocity in F_S for Euler rates.
        yaw: (n,) of the cab, rad.
        euler_rates: (n, 3) of roll, pitch and yaw of the cab, Eq. (3), rad/s.
        displacement: (n, 3) acceleration of Q = C + S in F_I, m/s^2, over the step that ends at a row.
        relative: (n, 3) aa_I, that of the cab's point against the hexapod's origin, Eq. (37), m/s^2.
    """

    dt: float
    to_inertial: Floats
    from_rates: Floats
    yaw: Floats
    euler_rates: Floats
    displacement: Floats
    relative: Floats

    @classmethod
    def of(cls, t: Trajectory, cab: Cab) -> Motion:
        """The motion of a recorded drive."""
        angles, rates = t.hexapod[:, 3:].copy(), t.hexapod_rate[:, 3:].copy()
        angles[:, 2] += t.turntable
        rates[:, 2] += t.turntable_rate
        to_inertial, axes = rotation(angles), turning_axes(angles)
        arm = to_inertial @ np.array(cab.reference_point)
        velocity = t.hexapod_rate[:, :3] + np.pad(t.carriage_rate, ((0, 0), (0, 1)))
        turning = np.cross(_times(axes, rates), arm)
        return cls(
            dt=t.dt,
            to_inertial=to_inertial,
            from_rates=np.swapaxes(to_inertial, 1, 2) @ axes,
            yaw=angles[:, 2],
            euler_rates=rates,
            displacement=np.diff(velocity, axis=0, prepend=velocity[:1]) / t.dt,
            relative=np.diff(turning, axis=0, prepend=turning[:1]) / t.dt,
        )

    def in_cab(self, vectors: Floats) -> Floats:
        """Components in F_S of vectors in F_I."""
        return _times(np.swapaxes(self.to_inertial, 1, 2), vectors)

    @property
    def force(self) -> Floats:
        """(n, 3) f = a - g in F_S, Eqs. (1) and (40), m/s^2."""
        return self.in_cab(self.displacement + self.relative - _G)

    @property
    def rate(self) -> Floats:
        """(n, 3) omega_SS = R_S betadot_S, Eq. (7), rad/s."""
        return _times(self.from_rates, self.euler_rates)


def high_passed(block: HighPass, values: Floats, dt: float) -> Floats:
    """A signal through a high-pass, from rest."""
    w = block.frequency
    numerator, denominator = {
        0: ([1.0], [1.0]),
        1: ([1.0, 0.0], [1.0, w]),
        2: ([1.0, 0.0, 0.0], [1.0, 2.0 * block.damping * w, w * w]),
    }[block.order]
    return np.asarray(signal.lfilter(*signal.bilinear(numerator, denominator, 1.0 / dt), values))


def high_passed_rates(p: WashoutParameters, t: Trajectory, motion: Motion) -> Floats:
    """(n, 3) beta1HP's rates: HPR of T_S omega_AA, Eq. (23), rad/s."""
    inputs: Floats = np.asarray(np.linalg.solve(motion.from_rates, t.w_reference[:, :, None])[:, :, 0], float)
    lag = signal.bilinear([1.0], [1.0 / p.rate_bandwidth, 1.0], 1.0 / t.dt)
    return np.column_stack(
        [signal.lfilter(*lag, high_passed(p.hpr[k], inputs[:, k], t.dt)) for k in range(3)]
    )


def displacement(p: WashoutParameters, t: Trajectory, motion: Motion) -> Floats:
    """(n, 3) acceleration of Q' in F_I, m/s^2: HPI of HPS of a2S, Eqs. (48) and (51).

    Over the step that ends at a row: car and angles are those of the row before.
    """
    begin = np.maximum(np.arange(len(t)) - 1, 0)
    to_inertial = motion.to_inertial[begin]
    a2s = t.f_reference[begin] - _times(np.swapaxes(to_inertial, 1, 2), motion.relative - _G)
    passed = np.column_stack([*(high_passed(p.hps[k], a2s[:, k], t.dt) for k in range(2)), a2s[:, 2]])
    in_space = _times(to_inertial, passed)
    return np.column_stack([high_passed(p.hpi[k], in_space[:, k], t.dt) for k in range(3)])


def tilt(p: WashoutParameters, t: Trajectory, motion: Motion) -> Floats:
    """(n, 2) roll and pitch that represent the slow force, rad: N fL, Eqs. (18) to (21), without limits.

    fL is the low-passed f1, without the centripetal part of Eq. (47).
    """
    assert p.tilt is not None
    w, zeta = p.tilt.low_pass.frequency, p.tilt.low_pass.damping
    low_pass = signal.bilinear([w * w], [1.0, 2.0 * zeta * w, w * w], 1.0 / t.dt)
    arm = -np.array(Cab().reference_point) * t.turntable_rate[:, None] ** 2
    fl = np.column_stack([signal.lfilter(*low_pass, t.f_reference[:, k] - arm[:, k]) for k in range(2)])
    s, c = np.sin(motion.yaw), np.cos(motion.yaw)
    return np.column_stack([-s * fl[:, 0] - c * fl[:, 1], c * fl[:, 0] - s * fl[:, 1]]) / GRAVITY
