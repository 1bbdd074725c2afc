"""Faults of a sender, and the cab's motion, for every policy that can be served. No network, no clock.

`python -m benchmarks.loop_faults` prints a table of jerks; docs/results/real-time.md has what it found.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from motion_cueing.baselines.registry import policy_names
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.realtime.controller import Controller, ControllerOptions
from motion_cueing.realtime.inbox import Inbox
from motion_cueing.realtime.machine import AT_REST, LiveMachine, make_machine
from motion_cueing.realtime.packets import Cues, FloatsFormat

Floats: TypeAlias = NDArray[np.float64]

RATE: Final = 100
PLATFORM: Final = "paper"
VESTIBULAR: Final = "zacharias"
SENDER: Final = ("127.0.0.1", 9)
NORMAL_RANGE: Final = 1.5
"""Largest felt cue with a fault, as a multiple of the policy's own in the drive without it."""


class Sent(NamedTuple):
    """A datagram on its way.

    Args:
        arrival: Time step in which it arrives.
        cues: Its content; None for noise.
    """

    arrival: int
    cues: Cues | None


Rows: TypeAlias = Floats
Fault: TypeAlias = Callable[[Rows, int, np.random.Generator], list[Sent]]
"""From (n, 6) cues of a drive, the row at which the fault begins, and a random generator to what arrives."""


def _packet(k: int, row: Sequence[float] | Floats, paused: bool = False, time: float | None = None) -> Sent:
    force, rate = tuple(map(float, row[:3])), tuple(map(float, row[3:]))
    return Sent(k, Cues(k, k / RATE if time is None else time, force, rate, paused))  # type: ignore[arg-type]


def _stream(rows: Rows) -> list[Sent]:
    return [_packet(k, row) for k, row in enumerate(rows)]


def _inserted(rows: Rows, at: int, middle: Rows, skip: int = 0) -> Rows:
    """Rows in between; the drive goes on behind them, ``skip`` rows later."""
    return np.vstack([rows[:at], middle, rows[at + skip :]])


def _changed(rows: Rows, at: int, values: Any) -> Rows:
    out = rows.copy()
    values = np.atleast_2d(values)
    out[at : at + len(values)] = values
    return out


def _added(rows: Rows, at: int, seconds: float, offset: Sequence[float]) -> Rows:
    out = rows.copy()
    out[at : at + round(seconds * RATE)] += offset
    return out


def _times(rows: Rows, at: int, seconds: float, factors: Sequence[float]) -> Rows:
    out = rows.copy()
    out[at : at + round(seconds * RATE)] *= factors
    return out


def _paused(rows: Rows, at: int, seconds: float, skip: int = 0) -> list[Sent]:
    """The sender says so, and sends what a menu sends: zeros."""
    n = round(seconds * RATE)
    sent = _stream(_inserted(rows, at, np.zeros((n, 6)), skip))
    for k in range(at, at + n):
        sent[k] = _packet(k, np.zeros(6), paused=True)
    return sent


def _wrapped(rows: Rows, at: int, rate: float) -> list[Sent]:
    """Two samples of a yaw rate that jumps, as the difference of an angle has it at +-180 deg."""
    out = rows.copy()
    out[at, 5], out[at + 1, 5] = rate, -rate
    return _stream(out)


def _repeating(rows: Rows, at: int, seconds: float, skip: int = 0) -> list[Sent]:
    """A paused game that goes on sending its last packet, with fresh numbers and stamps."""
    return _stream(_inserted(rows, at, np.tile(rows[at - 1], (round(seconds * RATE), 1)), skip))


def _frozen(rows: Rows, at: int, seconds: float) -> list[Sent]:
    """The force repeats, the angular velocity goes on."""
    out = rows.copy()
    out[at : at + round(seconds * RATE), :3] = rows[at - 1, :3]
    return _stream(out)


def _noise(rows: Rows, which: NDArray[Any]) -> list[Sent]:
    return [sent._replace(cues=None) if bad else sent for sent, bad in zip(_stream(rows), which, strict=True)]


def _nan(rows: Rows, which: NDArray[Any]) -> list[Sent]:
    rows = rows.copy()
    rows[which, 0] = math.nan
    return _stream(rows)


def _dropped(rows: Rows, which: NDArray[Any]) -> list[Sent]:
    return [sent for sent, gone in zip(_stream(rows), which, strict=True) if not gone]


def _stretch(rows: Rows, at: int, seconds: float) -> NDArray[Any]:
    k = np.arange(len(rows))
    return np.asarray((k >= at) & (k < at + round(seconds * RATE)))


def _late(rows: Rows, which: NDArray[Any], steps: NDArray[Any]) -> list[Sent]:
    """Some packets arrive steps later, in the order of their arrival."""
    late = [
        s._replace(arrival=s.arrival + int(n) * bool(w))
        for s, w, n in zip(_stream(rows), which, steps, strict=True)
    ]
    return sorted(late, key=lambda sent: sent.arrival)


def _stalled(rows: Rows, at: int, steps: int) -> list[Sent]:
    """All packets of a while arrive at its end, at once."""
    return [s._replace(arrival=at + steps) if at <= s.arrival < at + steps else s for s in _stream(rows)]


def _copies(rows: Rows, which: NDArray[Any]) -> list[Sent]:
    rows = rows.copy()
    for k in np.flatnonzero(which)[1:]:
        rows[k] = rows[k - 1]
    return _stream(rows)


def _restarted(rows: Rows, at: int) -> list[Sent]:
    """The sender ends, and begins 3 s later with new numbers and another clock."""
    sent = _stream(rows[:at])
    for k, row in enumerate(rows[at:]):
        one = _packet(k, row, time=5.0 + k / RATE)
        sent.append(one._replace(arrival=at + 3 * RATE + k))
    return sent


def _into_braking(rows: Rows, at: int) -> list[Sent]:
    """Three seconds of full braking come between: another drive."""
    braking = cues_of(get_maneuver("braking").drive())[0][9 * RATE : 12 * RATE]
    return _stream(_inserted(rows, at, braking))


SECOND: Final = RATE
FAULTS: Final[dict[str, Fault]] = {
    "none": lambda c, at, r: _stream(c),
    "spike of 50 m/s^2": lambda c, at, r: _stream(_added(c, at, 0.01, (0, 50, 0, 0, 0, 0))),
    "spike of 15 m/s^2": lambda c, at, r: _stream(_added(c, at, 0.01, (0, 15, 0, 0, 0, 0))),
    "spikes, 2 %": lambda c, at, r: _stream(c + (r.random((len(c), 1)) < 0.02) * [0, 9, 0, 0, 0, 0]),
    "Euler wrap of 99 rad/s": lambda c, at, r: _wrapped(c, at, 99.0),
    "Euler wrap of 4 rad/s": lambda c, at, r: _wrapped(c, at, 4.0),
    "zeros for 5 s": lambda c, at, r: _stream(_inserted(c, at, np.zeros((5 * SECOND, 6)))),
    "gravity reversed for 5 s": lambda c, at, r: _stream(_times(c, at, 5.0, (1, 1, -1, 1, 1, 1))),
    "gravity left out for 5 s": lambda c, at, r: _stream(_added(c, at, 5.0, (0, 0, 9.81, 0, 0, 0))),
    "paused, last packet for 10 s": lambda c, at, r: _repeating(c, at, 10.0),
    "paused and moved 2 s on": lambda c, at, r: _repeating(c, at, 5.0, 2 * SECOND),
    "flag of a pause for 5 s": lambda c, at, r: _paused(c, at, 5.0),
    "flag, moved 2 s on": lambda c, at, r: _paused(c, at, 5.0, 2 * SECOND),
    "reset to standing": lambda c, at, r: _stream(_changed(c, at, np.tile(AT_REST, (len(c) - at, 1)))),
    "teleport to 2 s later": lambda c, at, r: _stream(_inserted(c, at, c[:0], 2 * SECOND)),
    "teleport to 2 s before": lambda c, at, r: _stream(_inserted(c, at, c[at - 2 * SECOND :], len(c))),
    "teleport into braking": lambda c, at, r: _into_braking(c, at),
    "offset of 8 m/s^2 for 5 s": lambda c, at, r: _stream(_added(c, at, 5.0, (0, 8, 0, 0, 0, 0))),
    "force frozen for 3 s": lambda c, at, r: _frozen(c, at, 3.0),
    "a third are copies": lambda c, at, r: _copies(c, r.random(len(c)) < 1 / 3),
    "packets repeated": lambda c, at, r: [s for s in _stream(c) for _ in range(2)],
    "NaN, 5 %": lambda c, at, r: _nan(c, r.random(len(c)) < 0.05),
    "NaN for 1 s": lambda c, at, r: _nan(c, _stretch(c, at, 1.0)),
    "noise for 1 s": lambda c, at, r: _noise(c, _stretch(c, at, 1.0)),
    "lost, 10 %": lambda c, at, r: _dropped(c, r.random(len(c)) < 0.1),
    "lost for 0.15 s": lambda c, at, r: _dropped(c, _stretch(c, at, 0.15)),
    "lost for 2 s": lambda c, at, r: _dropped(c, _stretch(c, at, 2.0)),
    "late by up to 50 ms, 10 %": lambda c, at, r: _late(c, r.random(len(c)) < 0.1, r.integers(1, 6, len(c))),
    "stalled for 0.1 s": lambda c, at, r: _stalled(c, at, 10),
    "sender starts again": lambda c, at, r: _restarted(c, at),
}  # fmt: skip
"""What goes wrong, by name."""

OTHER_DRIVES: Final = ("teleport into braking", "offset of 8 m/s^2 for 5 s")
"""Faults after which the cues are those of another, fiercer drive. The bars are of the same one: missed."""


class Felt(NamedTuple):
    """What is felt in the cab over a drive.

    Args:
        force: (n, 3) specific force, m/s^2.
        rate: (n, 3) angular velocity, rad/s.
        counts: Of packets and of faults that the guard found.
    """

    force: Floats
    rate: Floats
    counts: dict[str, int]

    @property
    def jerk(self) -> float:
        """Largest change of the specific force on an axis, m/s^3."""
        return float(np.abs(np.diff(self.force, axis=0)).max() * RATE)

    @property
    def reach(self) -> float:
        """Largest distance of the specific force from a standing car's on an axis, m/s^2."""
        return float(np.abs(self.force - AT_REST[:3]).max())


def cues_of(drive: CueTrace) -> tuple[Rows, int]:
    """(n, 6) cues of a drive and the row in which its force is greatest, the worst moment for a fault."""
    rows = np.hstack([drive.specific_force, drive.angular_velocity])
    return rows, int(np.argmax(np.abs(rows[:, :2]).max(axis=1)))


def felt(machine: LiveMachine, policy: Any, sent: Sequence[Sent]) -> Felt:
    """What is felt when these packets arrive; the controller then brakes to its start pose."""
    platform, form, options = get_platform(PLATFORM), FloatsFormat(), ControllerOptions(rate=RATE)
    watchdog = options.watchdog
    inbox = Inbox(form, watchdog.stale, watchdog.overdue)
    machine.reset()
    controller = Controller(machine, platform, inbox, options)
    waiting, end = 0, sent[-1].arrival + 3 * RATE
    for k in range(end):
        while waiting < len(sent) and sent[waiting].arrival <= k:
            cues = sent[waiting].cues
            inbox.take(b"noise" if cues is None else form.pack_cues(cues), SENDER, k / RATE)
            waiting += 1
        controller.period(k / RATE)
    log = controller.log.trajectory(platform, machine.start, VESTIBULAR, policy)
    counts = {name: n for name, n in (inbox.counts | controller.guard.counts).items() if n}
    return Felt(log.f_simulator, log.w_simulator, counts)


def main() -> int:
    """The exit status is 1 if a bar is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--policies", nargs="*", default=None)
    parser.add_argument("--maneuver", default="double-lane-change")
    parser.add_argument("--faults", nargs="*", default=list(FAULTS))
    given = parser.parse_args()
    platform, missed = get_platform(PLATFORM), 0
    rows, at = cues_of(get_maneuver(given.maneuver).drive())
    for name in given.policies or policy_names():
        policy = make_policy(name, platform)
        try:
            machine = make_machine(policy, platform)
        except ConfigurationError as refusal:
            print(f"{name}: cannot be served: {refusal}")
            continue
        own = felt(machine, policy, FAULTS["none"](rows, at, np.random.default_rng(0)))
        print(f"{name}: jerk {own.jerk:.1f} m/s^3, reach {own.reach:.2f} m/s^2")
        for fault in given.faults:
            found = felt(machine, policy, FAULTS[fault](rows, at, np.random.default_rng(0)))
            ok = found.jerk <= 2.0 * own.jerk and found.reach <= NORMAL_RANGE * own.reach
            missed += not ok
            ratio, reach = (
                b / a if a > 0 else float(b > 0)
                for a, b in ((own.jerk, found.jerk), (own.reach, found.reach))
            )
            note = "" if ok else "MISSED"
            print(
                f"  {fault:30s} jerk x {ratio:5.2f}  reach x {reach:4.2f} {note} {found.counts}", flush=True
            )
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
