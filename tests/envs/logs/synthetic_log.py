"""A log with known truth: a car whose motion is written down, and a device that sits askew in it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
G = 9.81


@dataclass(frozen=True)
class Truth:
    """Motion of the car, at ``rate_hz``: planar, with body roll and pitch rates of zero mean."""

    time: Floats
    speed: Floats
    force: Floats
    rate: Floats
    course: Floats


def drive(seconds: float = 60.0, rate_hz: float = 50.0, standstill: float = 0.0) -> Truth:
    """Speeding up and slowing down in whole periods, turning both ways; at first standing still."""
    time = np.arange(round(seconds * rate_hz) + 1) / rate_hz
    moving = seconds - standstill
    phase = np.clip(time - standstill, 0.0, None) * 2.0 * np.pi / moving
    # Integrals and derivatives are written out, so that nothing depends on the code under test.
    omega = 2.0 * np.pi / moving
    speed = 7.0 * (1.0 - np.cos(2.0 * phase))
    along = np.where(time > standstill, 14.0 * omega * np.sin(2.0 * phase), 0.0)
    yaw_rate = np.where(time > standstill, 0.2 * np.sin(3.0 * phase) + 0.1 * np.sin(phase), 0.0)
    course = (0.2 * (1.0 - np.cos(3.0 * phase)) / 3.0 + 0.1 * (1.0 - np.cos(phase))) / omega
    roll_rate, pitch_rate = 0.05 * np.sin(4.0 * phase), 0.04 * np.sin(5.0 * phase)
    force = np.stack([along, speed * yaw_rate, np.full(len(time), -G)], axis=1)
    rate = np.stack([roll_rate, pitch_rate, yaw_rate], axis=1)
    return Truth(time, speed, force, rate, course)


def rotation(roll: float, pitch: float, yaw: float) -> Floats:
    """Rz(yaw) Ry(pitch) Rx(roll), rad, from its elements."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return np.array(
        [
            [cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy],
            [cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy],
            [-sp, sr * cp, cr * cp],
        ]
    )


@dataclass(frozen=True)
class Device:
    """How the truth is spoilt on the way into the log."""

    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    lateral_sign: int = 1
    rate_sign: int = 1
    rate_bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gravity_error: float = 0.0
    noise: float = 0.0
    speed_delay: float = 0.0

    def records(self, truth: Truth) -> dict[str, Floats]:
        """Columns of the log; biases are those of the car's axes."""
        rng = np.random.default_rng(1)
        to_car = np.diag([1.0, self.lateral_sign, 1.0]) @ rotation(self.roll, self.pitch, self.yaw)
        # Orthogonal, so its transpose takes car axes back to device axes.
        force = (truth.force - [0.0, 0.0, self.gravity_error]) @ to_car
        rate = self.rate_sign * (truth.rate + np.array(self.rate_bias)) @ to_car
        force = force + self.noise * rng.standard_normal(force.shape)
        rate = rate + 0.1 * self.noise * rng.standard_normal(rate.shape)
        late = truth.time - self.speed_delay
        columns = dict(zip(("ax", "ay", "az"), force.T, strict=True))
        columns |= dict(zip(("wx", "wy", "wz"), rate.T, strict=True))
        speed, course = np.interp(late, truth.time, truth.speed), np.interp(late, truth.time, truth.course)
        return {"t": truth.time, **columns, "v": speed, "course": np.mod(course, 2.0 * np.pi)}


COLUMNS = {
    "time": "t",
    "force_x": "ax",
    "force_y": "ay",
    "force_z": "az",
    "rate_x": "wx",
    "rate_y": "wy",
    "rate_z": "wz",
    "speed": "v",
}
WITH_COURSE = {**COLUMNS, "course": "course"}


def write(path: Path, table: dict[str, Floats]) -> Path:
    """Write columns as CSV; NaN becomes an empty cell."""
    rows = np.column_stack(list(table.values()))
    lines = [",".join("" if np.isnan(x) else repr(float(x)) for x in row) for row in rows]
    path.write_text("\n".join([",".join(table), *lines]) + "\n")
    return path
