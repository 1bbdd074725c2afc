"""``motion-cueing drive``: the test client of ``motion-cueing serve``."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError
from ..envs.storage import check_file
from ..evaluation.reporting.text import words_of
from ..evaluation.selection import find_car, find_maneuvers, find_platform
from ..realtime.client import Client, NetworkFaults, cues_at
from ..realtime.packets import make_format
from ..realtime.report import report_of, show
from ..realtime.server import Endpoint, address_of, is_loopback
from ..realtime.timing import undisturbed
from ..train.training import Interrupt
from .serve import DEFAULT_PORT


@dataclass(frozen=True)
class DriveCommand:
    """Drive a controller that `motion-cueing serve` runs: send cues in real time, check what comes back.

    The exit status is 1 if nothing came back, or a set-point outside of the machine's limits. docs/loop.md
    describes the packets.
    """

    maneuver: Annotated[str, arg(metavar="NAME|FILE")] = "double-lane-change"
    """Maneuver or recording, by name or cue CSV file."""
    to: Annotated[str, arg(metavar="HOST[:PORT]")] = f"127.0.0.1:{DEFAULT_PORT}"
    """Where the controller listens."""
    rate: int = 1000
    """Packets a second; also the rate of the set-points that are expected."""
    times: int = 1
    """How often the maneuver is driven, one behind the other."""
    platform: Annotated[str, arg(metavar="NAME|FILE")] = "paper"
    """Motion base of the controller, by name or YAML file, for its limits."""
    car: Annotated[str, arg(metavar="NAME|FILE")] = "sedan"
    """Car, by name or YAML file."""
    format: Literal["floats", "msgpack"] = "floats"
    """How packets are written; as the controller's."""
    drop: float = 0.0
    """Share of the packets that are not sent."""
    repeat: float = 0.0
    """Share that is sent twice."""
    late: float = 0.0
    """Share that is sent up to 50 ms late, out of order."""
    nan: float = 0.0
    """Share with a NaN in it."""
    seed: int = 0
    """Of what happens to packets."""
    after: float = 1.0
    """Time to go on listening after the last packet, s."""
    cpu: int | None = None
    """Core to run on alone."""
    report: Annotated[Path | None, arg(metavar="FILE.json")] = None
    """Counts and timings to write."""


def run(command: DriveCommand) -> int:
    """Drive; the exit status is 1 if nothing came back, or something outside of the limits.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    _check(command)
    trace = _trace(command)
    to = address_of(command.to, DEFAULT_PORT)
    network = NetworkFaults(command.drop, command.repeat, command.late, command.nan, command.seed)
    # From the loopback address nothing leaves this machine; other targets are reached from any.
    endpoint = Endpoint(("127.0.0.1" if is_loopback(to) else "0.0.0.0", 0))
    try:
        platform, form = find_platform(command.platform), make_format(command.format)
        client = Client(endpoint, to, form, platform, command.rate, network)
        interrupt = Interrupt()
        with interrupt.caught(), undisturbed(command.cpu):
            client.run(cues_at(trace, command.rate, command.times), lambda: interrupt.asked)
            client.listen(command.after)
    finally:
        endpoint.close()
    return _finish(command, client, endpoint)


def _check(command: DriveCommand) -> None:
    if command.rate < 1 or command.times < 1 or not 0.0 <= command.after < math.inf:
        raise ConfigurationError("--rate and --times must be at least 1, --after at least 0 and finite")
    if command.report is not None:
        check_file("--report", command.report)


def _trace(command: DriveCommand) -> CueTrace:
    sources = find_maneuvers((command.maneuver,), find_car(command.car))
    if len(sources) != 1:
        raise ConfigurationError(f"--maneuver {command.maneuver} means several drives; name one")
    (source,) = sources.values()
    return source()


def _finish(command: DriveCommand, client: Client, endpoint: Endpoint) -> int:
    report = report_of(
        words_of("drive", command),
        client,
        periods=client.periods,
        packets={**client.counts, "unsent": endpoint.unsent},
        states=client.states,
        faults=client.faults,
    )
    show(report, "set-points", command.report)
    return 0 if client.counts["received"] and not client.counts["outside_limits"] else 1
