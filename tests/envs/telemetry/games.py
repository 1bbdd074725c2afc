"""Senders of each game, written from the public descriptions with struct: a known motion as its datagram.

The motion is in the car's axes (forward, right, down) and in the world's (north, east, down). Each game's
axes are reached by words such as "right, up, forward", never by the code under test.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, replace

import numpy as np

G = 9.81
G0 = 9.80665


@dataclass(frozen=True)
class Motion:
    """A known motion at a moment.

    Attributes:
        time: s.
        roll, pitch, heading: Right side down, nose up, to the right positive, rad.
        acceleration: (3,) of the car, without gravity, car axes.
        rate: (3,) car axes.
        velocity, position: (3,) north, east, down.
        paused: Nobody drives.
    """

    time: float = 1.0
    roll: float = 0.0
    pitch: float = 0.0
    heading: float = 0.0
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    paused: bool = False

    def axes(self) -> np.ndarray:
        """(3, 3) the car's forward, right and down axes as rows, in north, east, down.

        From elementary turns: heading about down, then pitch about right, then roll about forward.
        """
        (cr, sr), (cp, sp), (ch, sh) = ((np.cos(a), np.sin(a)) for a in (self.roll, self.pitch, self.heading))
        yaw = np.array([[ch, sh, 0.0], [-sh, ch, 0.0], [0.0, 0.0, 1.0]])
        pitch = np.array([[cp, 0.0, -sp], [0.0, 1.0, 0.0], [sp, 0.0, cp]])
        roll = np.array([[1.0, 0.0, 0.0], [0.0, cr, sr], [0.0, -sr, cr]])
        return roll @ pitch @ yaw

    def force(self) -> np.ndarray:
        """(3,) specific force a - g."""
        return np.array(self.acceleration) - G * self.axes()[:, 2]

    def world(self, vector) -> np.ndarray:
        """A vector of the car in north, east, down."""
        return self.axes().T @ np.array(vector)


def beamng(m: Motion) -> bytes:
    """x east, y north, z up; accelerations right, forward, up; roll and yaw of the angles negated."""

    def world(v):
        return v[1], v[0], -v[2]

    ahead, right, down = m.acceleration
    return struct.pack(
        "<4s21f", b"BNG1", *world(m.position), *world(m.velocity), right, ahead, -down,
        *world(-m.axes()[2]), -m.roll, m.pitch, -m.heading, *m.rate, 0.0, 0.0, 0.0,
    )  # fmt: skip


def outsim(m: Motion, identifier: bool = False) -> bytes:
    """x east, y north, z up; all vectors in the world; heading anticlockwise; position in 1/65536 m."""

    def world(v):
        return v[1], v[0], -v[2]

    position = [round(65536 * p) for p in world(m.position)]
    data = struct.pack(
        "<I12f3i", round(1000 * m.time) % 2**32, *world(m.world(m.rate)), -m.heading, m.pitch, m.roll,
        *world(m.world(m.acceleration)), *world(m.velocity), *position,
    )  # fmt: skip
    return data + struct.pack("<i", 7) if identifier else data


def forza(m: Motion, size: int = 232) -> bytes:
    """x right, y up, z forward; turns of a left-handed system: nose down, to the right, left side down."""
    ahead, right, down = m.acceleration
    v_ahead, v_right, v_down = m.axes() @ np.array(m.velocity)
    p, q, r = m.rate
    sled = struct.pack(
        "<iI3f3f3f3f3f", 0 if m.paused else 1, round(1000 * m.time) % 2**32, 7000.0, 800.0, 3000.0,
        right, -down, ahead, v_right, -v_down, v_ahead, -q, r, -p, m.heading, -m.pitch, -m.roll,
    )  # fmt: skip
    sled += bytes(232 - len(sled))
    if size == 232:
        return sled
    north, east, down = m.position
    between = bytes(12) if size == 324 else b""
    data = sled + between + struct.pack("<3f", east, -down, north)
    return data + bytes(size - len(data))


def engine_world(v, right_handed: bool):
    """North, east, down as x, y, z with y up: z is south in right-handed axes, north in left-handed ones."""
    return v[1], -v[2], -v[0] if right_handed else v[0]


def f1(m: Motion, player: int = 3, version: int = 2023, right_handed: bool = False) -> bytes:
    """Header of 29 bytes, 22 cars of 60; directions as whole numbers."""
    ahead, right, _ = m.axes()
    cars = bytearray(22 * 60)
    struct.pack_into(
        "<6f6h6f", cars, 60 * player,
        *engine_world(m.position, right_handed), *engine_world(m.velocity, right_handed),
        *(round(32767 * c) for c in engine_world(ahead, right_handed)),
        *(round(32767 * c) for c in engine_world(right, right_handed)),
        m.acceleration[1] / G0, m.acceleration[0] / G0, 1.0, 0.0, 0.0, 0.0,
    )  # fmt: skip
    return f1_header(m, 0, player, version) + bytes(cars)


def f1_header(m: Motion, kind: int, player: int = 3, version: int = 2023) -> bytes:
    return struct.pack("<HBBBBBQfIIBB", version, version % 100, 1, 0, 1, kind, 5, m.time, 60, 60, player, 255)


def f1_session(m: Motion, version: int = 2023) -> bytes:
    """The pause is byte 14 behind the header, spectating byte 15."""
    size = {2023: 644, 2024: 753}[version]
    data = bytearray(f1_header(m, 1, version=version) + bytes(size - 29))
    data[29 + 14] = int(m.paused)
    return bytes(data)


def dirt(m: Motion, right_handed: bool = False) -> bytes:
    """66 floats."""
    ahead, right, _ = m.axes()
    values = np.zeros(66)
    values[0] = m.time
    values[4:7] = engine_world(m.position, right_handed)
    values[7] = np.linalg.norm(m.velocity)
    values[8:11] = engine_world(m.velocity, right_handed)
    values[11:14] = engine_world(right, right_handed)
    values[14:17] = engine_world(ahead, right_handed)
    values[34], values[35] = m.acceleration[1] / G0, m.acceleration[0] / G0
    return struct.pack("<66f", *values)


def xplane(m: Motion) -> bytes:
    """Answers in the order of the requests; x east, y up, z south; degrees."""

    def world(v):
        return v[1], -v[2], -v[0]

    values = [
        m.time, *world(m.world(m.acceleration)), *np.degrees(m.rate),
        *np.degrees([m.roll, m.pitch, m.heading]), *world(m.velocity), *world(m.position), m.paused, 0.0,
    ]  # fmt: skip
    return b"RREF," + b"".join(struct.pack("<if", k, value) for k, value in enumerate(values))


def mcgc(m: Motion) -> bytes:
    head = (2, 1) if m.paused else (1, 0)
    body = struct.pack("<4sHHQ7d", b"MCGC", *head, round(100 * m.time), m.time, *m.force(), *m.rate)
    return body + struct.pack("<I", zlib.crc32(body))


PACK = {
    "beamng": beamng,
    "outsim": outsim,
    "forza": forza,
    "f1": f1,
    "dirt": dirt,
    "xplane": xplane,
    "mcgc": mcgc,
}


def later(m: Motion, dt: float) -> Motion:
    """The motion a moment later, to first order: only differences of small steps are taken from it."""
    turned = m.axes()
    # d(axes)/dt = -[rate] x axes, as the car's axes turn in the world.
    w = np.array(m.rate)
    angle = np.linalg.norm(w) * dt
    if angle > 0.0:
        k = w / np.linalg.norm(w)
        cross = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
        turn = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
        turned = turn.T @ turned
    ahead, right, down = turned
    velocity = np.array(m.velocity) + dt * (0.5 * (m.axes() + turned)).T @ np.array(m.acceleration)
    position = np.array(m.position) + 0.5 * dt * (velocity + np.array(m.velocity))
    return replace(
        m,
        time=m.time + dt,
        heading=float(np.arctan2(ahead[1], ahead[0])),
        pitch=float(np.arcsin(-ahead[2])),
        roll=float(np.arctan2(right[2], down[2])),
        velocity=tuple(velocity),
        position=tuple(position),
    )
