"""A controller under datagrams that no sender means: does it crash, does a set-point leave the limits?

Run it with `python -m benchmarks.fuzz_loop --datagrams 1000000`; docs/results/real-time.md has what it found.
"""

from __future__ import annotations

import argparse
import itertools
import math
import struct
import sys
import time
import zlib
from collections import Counter
from collections.abc import Iterator

import numpy as np

from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.realtime.client import LimitCheck
from motion_cueing.realtime.controller import Controller, ControllerOptions
from motion_cueing.realtime.inbox import Inbox
from motion_cueing.realtime.machine import make_machine
from motion_cueing.realtime.packets import Cues, Format, make_format
from motion_cueing.realtime.watchdog import WatchdogOptions

RATE = 1000
WILD = (math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 0.0, -0.0, 1e3, -1e3, 100.0, 1e6)
"""Numbers that break code."""
SILENCES = 0.0001
"""Share of the periods at which a silence begins."""
LONGEST_SPELL = 10.0
"""Longest time with one share of bad datagrams, s."""
LONGEST_SILENCE = 20.0
"""Longer than any return to neutral, s."""


class Sender:
    """Draws datagrams: noise, broken packets, and whole ones with cues and numbers of every kind.

    Args:
        form: Wire format.
        seed: Of all draws.
        pauses: Share of the whole packets that say that the drive is paused.
    """

    def __init__(self, form: Format, seed: int, pauses: float) -> None:
        self._form, self._random = form, np.random.default_rng(seed)
        self._pauses, self._pause_random = pauses, np.random.default_rng(seed + 2)
        self._sequence, self._past = 0, [b"", b"MCGC", b"MCGS"]
        self._draws = (self._noise, self._old, self._broken, self._wild, self._rough)
        self._hostile, self._until = 0.0, 0.0

    def datagram(self, now: float) -> bytes:
        """The next one, sent at ``now``, s."""
        if now >= self._until:
            self._hostile = float(self._random.choice([0.0, 0.01, 0.1, 1.0]))
            self._until = now + float(self._random.uniform(0.0, LONGEST_SPELL))
        if self._random.random() >= self._hostile:
            return self._good(now)
        data = self._draws[self._random.integers(len(self._draws))](now)
        if self._random.random() < 0.01:
            self._past[self._random.integers(len(self._past))] = data
        return data

    def _good(self, now: float) -> bytes:
        """The next of a wild drive."""
        self._sequence += 1
        turn = 2.0 * math.pi * now * np.array([0.1, 0.31, 0.07])
        return self._packed(self._sequence, now, [*(20.0 * np.sin(turn)), *np.sin(3.0 * turn)])

    def _noise(self, now: float) -> bytes:
        return self._random.bytes(int(self._random.choice([0, 1, 4, 75, 76, 77, 364, 1500, 2049])))

    def _old(self, now: float) -> bytes:
        return self._past[self._random.integers(len(self._past))]

    def _broken(self, now: float) -> bytes:
        """A good packet with bits turned, cut or longer; half of them with a right checksum."""
        data = bytearray(self._rough(now))
        for _ in range(self._random.integers(1, 4)):
            data[self._random.integers(len(data))] ^= 1 << self._random.integers(8)
        if self._random.random() < 0.5:
            data[-4:] = struct.pack("<I", zlib.crc32(data[:-4]))
        return bytes(data[: self._random.integers(len(data) + 1)] if self._random.random() < 0.3 else data)

    def _wild(self, now: float) -> bytes:
        numbers = [float(self._random.choice(WILD)) for _ in range(7)]
        sequence = self._sequence + int(self._random.choice([0, 1, -1, 100, 10**7, 2**40]))
        return self._packed(sequence, numbers[0], numbers[1:])

    def _rough(self, now: float) -> bytes:
        """A whole packet with cues up to what is believed, in order."""
        self._sequence += int(self._random.choice([1, 1, 1, 1, 2, 50]))
        scale = self._random.choice([1.0, 10.0, 100.0, 999.0])
        force, rate = self._random.uniform(-scale, scale, 3), self._random.uniform(-0.1, 0.1, 3) * scale
        delay = self._random.choice([0.0, 0.001, 0.04, 0.5, -1.0], p=[0.9, 0.04, 0.04, 0.015, 0.005])
        return self._packed(self._sequence, now - delay, [*force, *rate])

    def _packed(self, sequence: int, stamp: float, cues: list[float]) -> bytes:
        fx, fy, fz, wx, wy, wz = map(float, cues)
        paused = bool(self._pause_random.random() < self._pauses)
        return self._form.pack_cues(Cues(max(sequence, 0), stamp, (fx, fy, fz), (wx, wy, wz), paused))


def moments(count: int, random: np.random.Generator) -> Iterator[int]:
    """Datagrams in each period, ``count`` in all: one or a few, and sometimes none for long."""
    while count > 0:
        if random.random() < SILENCES:
            yield from itertools.repeat(0, int(RATE * random.uniform(0.0, LONGEST_SILENCE)))
        now = min(count, int(random.choice([0, 1, 1, 1, 2, 5])))
        count -= now
        yield now


def run(policy: str, form: Format, count: int, seed: int, pauses: float = 0.0) -> int:
    """Feed a controller; returns the set-points outside of the limits."""
    platform, options = get_platform("paper"), WatchdogOptions()
    machine = make_machine(make_policy(policy, platform), platform)
    inbox = Inbox(form, options.stale, options.overdue)
    controller = Controller(machine, platform, inbox, ControllerOptions(rate=RATE, watchdog=options))
    sender, check = Sender(form, seed, pauses), LimitCheck(platform, RATE)
    states: Counter[str] = Counter()
    outside, begin = 0, time.perf_counter()
    for k, datagrams in enumerate(moments(count, np.random.default_rng(seed + 1))):
        now = k / RATE
        for _ in range(datagrams):
            inbox.take(sender.datagram(now), ("127.0.0.1", 1), now)
        setpoint = controller.period(now)
        states[setpoint.state.name.lower()] += 1
        fault = check(setpoint)
        if fault:
            outside += 1
            print(fault, file=sys.stderr)
    print(f"{policy}, {form.name}: {sum(inbox.counts.values())} datagrams, {controller.periods} set-points,")
    print(f"  {outside} outside of the limits, {time.perf_counter() - begin:.0f} s")
    print(f"  packets: {inbox.counts}, lost {inbox.lost}")
    print(f"  set-points by state: {dict(states)}; faults: {controller.faults or 'none'}")
    return outside


def main() -> int:
    """The exit status is 1 if a set-point was outside of the limits."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--policy", default="classical-tuned")
    parser.add_argument("--format", default="floats")
    parser.add_argument("--datagrams", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--pauses", type=float, default=0.0)
    given = parser.parse_args()
    form = make_format(given.format)
    return int(run(given.policy, form, given.datagrams, given.seed, given.pauses) > 0)


if __name__ == "__main__":
    sys.exit(main())
