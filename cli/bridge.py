"""``motion-cueing bridge``: telemetry of a simulator or game goes to the controller."""

from __future__ import annotations

import sys
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

from cyclopts import Parameter

from ..envs.errors import ConfigurationError
from ..envs.storage import check_file
from .arguments import Whole, named, option, several
from .serve import DEFAULT_PORT, terminated_gently

if TYPE_CHECKING:
    from ..envs.telemetry import Source
    from ..realtime.bridge import Bridge, BridgeLoop
    from ..realtime.inbox import Address

_SHOWN_S: Final = 10.0
"""Time between two lines about doubts, s."""


@dataclass(frozen=True, kw_only=True)
class BridgeCommand:
    """Take telemetry of a simulator or game, and send cues to the controller that `motion-cueing serve` runs.

    Knows menus, pauses, replays, teleports and repeated packets: the controller learns that the drive is
    paused. Ctrl-C ends it; then it says whether the cues followed speed and course.
    docs/guides/bridge.md has the settings of each game.
    """

    source: Annotated[str, option("NAME", name="--from", completer=named("Sources of telemetry"))] = ""
    """Protocol: beamng, outsim (Live for Speed), forza, f1, dirt (DiRT Rally), xplane, mcgc (cue packets of
    this project); --list describes them."""
    listen: Annotated[str, option("[HOST:]PORT")] = ""
    """Where telemetry arrives; default: 127.0.0.1 and the protocol's usual port. 0.0.0.0:PORT for a game on
    another machine."""
    to: Annotated[str, option("HOST[:PORT]")] = f"127.0.0.1:{DEFAULT_PORT}"
    """Where the controller listens."""
    simulator: Annotated[str, option("HOST[:PORT]")] = "127.0.0.1"
    """Where a simulator runs that sends on request alone (X-Plane)."""
    rate: Whole = 1000
    """Packets a second."""
    smoothing: Whole = 2
    """Frames of the game by which cues are smoothed, 1 to 3; they are late by it."""
    margin: float = 0.005
    """Time for which a frame that is late on its way is waited for, s."""
    frozen: float = 0.25
    """Time without a new frame after which the drive counts as paused, s."""
    settle: float = 0.5
    """Time for which telemetry must have come without a fault before it is followed again, s."""
    teleport: float = 3.0
    """Distance from where the velocity leads, beyond which the car was moved, m."""
    reverse: Annotated[tuple[Literal["f_x", "f_y", "w_x", "w_y", "w_z"], ...], several("CUE ...")] = ()
    """Cues whose sign is changed, where the check at the end says so."""
    format: Literal["floats", "msgpack"] = "floats"
    """How packets to the controller are written; as the controller's."""
    duration: float | None = None
    """Time after which it ends, s; default: until Ctrl-C."""
    record: Annotated[Path | None, option("FILE")] = None
    """Write all datagrams as they arrive, a new file, for `motion-cueing import`."""
    report: Annotated[Path | None, option("FILE.json")] = None
    """Counts and slopes to write."""
    list: Annotated[bool, Parameter(negative=())] = False
    """Show the protocols, and what is uncertain about each."""


def run(command: BridgeCommand) -> int:
    """Bridge until it is stopped."""
    if command.list:
        print("\n".join(source_lines()))
        return 0
    if not command.source:
        raise ConfigurationError("--from is missing: name a protocol, or see --list")
    from ..envs.telemetry import Datagram, StreamWriter, get_source
    from ..realtime.bridge import Bridge, BridgeLoop, BridgeOptions
    from ..realtime.packets import make_format
    from ..realtime.server import Endpoint, address_of, is_loopback

    _check(command)
    source = get_source(command.source)
    options = BridgeOptions(
        smoothing=command.smoothing,
        margin=command.margin,
        frozen=command.frozen,
        settle=command.settle,
        teleport=command.teleport,
        reverse=command.reverse,
    )
    to = address_of(command.to, DEFAULT_PORT)
    bridge = Bridge(source, options)
    with ExitStack() as stack:
        inlet = Endpoint(_listen(command.listen, source))
        stack.callback(inlet.close)
        outlet = Endpoint(("127.0.0.1" if is_loopback(to) else "0.0.0.0", 0))
        stack.callback(outlet.close)
        record = None
        if command.record is not None:
            writer = stack.enter_context(StreamWriter(command.record, source.name))
            record = lambda data: writer.add(Datagram(time.time(), data))  # noqa: E731
        requests = source.requests()
        simulator = (address_of(command.simulator, source.simulator_port), requests) if requests else None
        loop = BridgeLoop(
            bridge, inlet, outlet, to, make_format(command.format), command.rate, record, simulator
        )
        _run(command, bridge, loop, inlet.address)
    _finish(command, bridge, loop)
    return 0


def _check(command: BridgeCommand) -> None:
    if command.duration is not None and not command.duration > 0.0:
        raise ConfigurationError(f"--duration must be positive, found {command.duration:g}")
    if command.rate < 1:
        raise ConfigurationError(f"--rate must be at least 1, found {command.rate}")
    for flag, file in (("--record", command.record), ("--report", command.report)):
        if file is not None:
            check_file(flag, file)


def _listen(text: str, source: Source) -> Address:
    from ..realtime.server import address_of

    return address_of(f"127.0.0.1:{text}" if text.isdigit() else text or "127.0.0.1", source.port)


def source_lines() -> list[str]:
    """Each protocol with its usual port, its datagrams' sizes, and what is uncertain."""
    from ..envs.telemetry import get_source, source_names

    lines = []
    for name in source_names():
        source = get_source(name)
        lines.append(f"{name:<8} {source.summary}; usual port {source.port}")
        if source.uncertain:
            lines.append(f"{'':<8} {source.uncertain}")
    return lines


def _run(command: BridgeCommand, bridge: Bridge, loop: BridgeLoop, address: Address) -> None:
    from ..envs.progress import Interrupt
    from ..realtime.timing import undisturbed

    interrupt, limit = Interrupt(), command.duration
    followed, told = False, 0.0

    def ends(seconds: float) -> bool:
        nonlocal followed, told
        if bridge.follows != followed:
            followed = bridge.follows
            what = f"driving, {bridge.rate:.1f} frames a second" if followed else "paused"
            print(f"{seconds:8.2f} s  {what}", flush=True)
        if seconds - told > _SHOWN_S:
            told = seconds
            for doubt in bridge.check.doubts():
                print(f"{seconds:8.2f} s  {doubt}", file=sys.stderr, flush=True)
            if not bridge.begun:
                why = f"; refused: {bridge.refused}" if bridge.refused else ""
                print(f"{seconds:8.2f} s  no telemetry yet{why}", file=sys.stderr, flush=True)
        return interrupt.asked or (limit is not None and seconds >= limit)

    with interrupt.caught(), terminated_gently(), undisturbed():
        host, port = address
        print(
            f"{command.source}: UDP {host}:{port}, {command.rate} packets a second to {command.to}",
            flush=True,
        )
        try:
            loop.run(ends)
        except KeyboardInterrupt:
            # Ctrl-C a second time; what was counted is shown all the same.
            print("stopped", file=sys.stderr)


def _finish(command: BridgeCommand, bridge: Bridge, loop: BridgeLoop) -> None:
    from ..evaluation.reporting.text import words_of
    from ..realtime.bridge import BridgeReport

    report = BridgeReport.of(
        ["--from" if word == "--source" else word for word in words_of("bridge", command)], bridge, loop
    )
    print("\n".join(report.lines()))
    if command.report is not None:
        report.save_json(command.report)
