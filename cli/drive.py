"""``motion-cueing drive``: the test client of ``motion-cueing serve``."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from ..envs.errors import ConfigurationError
from ..envs.storage import check_file
from .arguments import CarName, ManeuverName, Name, Whole, find_car, find_maneuver, find_platform, option
from .serve import DEFAULT_PORT

if TYPE_CHECKING:
    from ..realtime.client import Client
    from ..realtime.server import Endpoint


@dataclass(frozen=True, kw_only=True)
class DriveCommand:
    """Drive a controller that `motion-cueing serve` runs: send cues in real time, check what comes back.

    The exit status is 1 if nothing came back, or a set-point outside of the machine's limits. docs/loop.md
    describes the packets.
    """

    maneuver: ManeuverName = "double-lane-change"
    to: Annotated[str, option("HOST[:PORT]")] = f"127.0.0.1:{DEFAULT_PORT}"
    """Where the controller listens."""
    rate: Whole = 1000
    """Packets a second; also the rate of the set-points that are expected."""
    times: Whole = 1
    """How often the maneuver is driven, one behind the other."""
    platform: Name = "paper"
    """Motion base of the controller, by name or YAML file, for its limits."""
    car: CarName = "sedan"
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
    seed: Whole = 0
    """Of what happens to packets."""
    after: float = 1.0
    """Time to go on listening after the last packet, s."""
    cpu: Whole | None = None
    """Core to run on alone."""
    report: Annotated[Path | None, option("FILE.json")] = None
    """Counts and timings to write."""


def run(command: DriveCommand) -> int:
    """Drive; the exit status is 1 if nothing came back, or something outside of the limits.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    from ..envs.progress import Interrupt
    from ..realtime.client import Client, NetworkFaults, cues_at
    from ..realtime.packets import make_format
    from ..realtime.server import Endpoint, address_of, is_loopback
    from ..realtime.timing import undisturbed

    _check(command)
    trace = find_maneuver(command.maneuver, find_car(command.car))[1]()
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


def _finish(command: DriveCommand, client: Client, endpoint: Endpoint) -> int:
    from ..evaluation.reporting.text import words_of
    from ..realtime.report import report_of, show

    if not client.counts["received"]:
        raise OSError(None, "nothing came back; is `motion-cueing serve` running there?", command.to)
    report = report_of(
        words_of("drive", command),
        client,
        periods=client.periods,
        packets={**client.counts, "unsent": endpoint.unsent},
        states=client.states,
        faults=client.faults,
    )
    show(report, "set-points", command.report)
    return 1 if client.counts["outside_limits"] else 0
