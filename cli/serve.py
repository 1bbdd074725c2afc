"""``motion-cueing serve`` and ``drive``: a controller in real time over UDP, and its test client."""

from __future__ import annotations

import math
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from ..envs.errors import ConfigurationError
from ..envs.progress import compilation_announced
from ..envs.storage import check_file
from . import arguments
from .arguments import (
    CarName,
    Compensate,
    ManeuverName,
    Name,
    PlatformName,
    PolicyName,
    ScaleText,
    Whole,
    option,
    several,
)

if TYPE_CHECKING:
    from ..envs.platform import Platform
    from ..realtime.client import Client
    from ..realtime.controller import Controller
    from ..realtime.inbox import Address
    from ..realtime.machine import LiveMachine
    from ..realtime.outputs import Output
    from ..realtime.report import LoopReport
    from ..realtime.server import Endpoint, Server

DEFAULT_PORT: Final = 47100
_VESTIBULAR: Final = "zacharias"


@dataclass(frozen=True, kw_only=True)
class ServeCommand:
    """Run a policy as a controller in real time: cues come over UDP, set-points go out.

    Listens on this machine alone unless --host says otherwise. Ctrl-C brakes to neutral, writes the log and
    the report, and ends. A policy that must know the whole drive beforehand cannot be served.
    docs/reference/real-time.md describes the packets.
    """

    policy: PolicyName = "classical-tuned"
    rate: Whole = 1000
    """Set-points a second, a multiple of 100; the policy acts 100 times a second."""
    platform: PlatformName = "paper"
    scale: ScaleText = "1"
    compensate: Compensate = False
    preview: Literal["true", "held", "predicted"] = "true"
    """Where a policy with a preview has it from: cues that are sent ahead of time, the present cue, or a
    predictor."""
    predictor: Annotated[str, option("NAME|FILE.safetensors")] = "road"
    """The predictor of --preview predicted."""
    host: str = "127.0.0.1"
    """Address to listen at; 0.0.0.0 for all, so that others on the network can move the machine."""
    port: Whole = DEFAULT_PORT
    """Port to listen at; 0 for any that is free."""
    peer: Annotated[str, option("HOST[:PORT]")] = ""
    """Listen to this sender alone; default: to the first, until it falls silent."""
    format: Literal["floats", "msgpack"] = "floats"
    """How packets are written."""
    duration: float | None = None
    """Time after which it brakes and ends, s; default: until Ctrl-C."""
    overdue: float = 0.03
    """Age of the newest cues from which they are held, s."""
    hold: float = 0.2
    """Age from which the machine brakes and goes to neutral, s."""
    stale: float = 0.05
    """Delay on the way, beyond the least seen, from which a packet is too old, s."""
    steady: float = 0.2
    """How long cues must have come without a gap before the policy begins, s."""
    fade: float = 1.0
    """Time in which the cues come in then, s."""
    max_force: float = 30.0
    """Largest plausible horizontal specific force on an axis, m/s^2; packets beyond it are not used."""
    max_vertical: float = 9.0
    """Largest plausible distance of the vertical specific force from that of a standing car, m/s^2."""
    max_angular_velocity: float = 5.0
    """Largest plausible angular velocity about an axis, rad/s."""
    max_jerk: float = 100.0
    """Fastest plausible change of the horizontal specific force, m/s^3; jumps beyond it fade."""
    max_vertical_jerk: float = 300.0
    """Of the vertical one, m/s^3."""
    max_angular_acceleration: float = 10.0
    """Fastest plausible change of an angular velocity, rad/s^2."""
    stuck: float = 0.5
    """Time after which cues that repeat to the bit count as stuck, s."""
    fault_fade: float = 1.0
    """Time in which cues fade out and in around a fault or a pause, s."""
    output: Annotated[tuple[Path, ...], several("FILE.yaml ...")] = ()
    """Templates of set-points for other motion controllers, which are sent as well."""
    lead: float = 0.001
    """Time before its first set-point at which a step of 10 ms is decided, s; at most a period."""
    cpu: Whole | None = None
    """Core to run on alone."""
    priority: Whole | None = None
    """Real-time priority (SCHED_FIFO), 1 to 99; needs the right to it."""
    view: bool = False
    """Show the machine in a browser at 30 frames a second: a page on this machine, from a process of its
    own."""
    view_port: Whole = 0
    """Port of that page; 0 for any that is free."""
    log: Annotated[Path | None, option("FILE.npz")] = None
    """Trajectory to write, a new file, for `motion-cueing evaluate --replays`."""
    report: Annotated[Path | None, option("FILE.json")] = None
    """Counts and timings to write."""


@dataclass(frozen=True, kw_only=True)
class DriveCommand:
    """Drive a controller that `motion-cueing serve` runs: send cues in real time, check what comes back.

    The exit status is 1 if nothing came back, or a set-point outside of the machine's limits.
    docs/reference/real-time.md describes the packets.
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


@dataclass(frozen=True)
class _Served:
    """Everything a command names, made before anything listens."""

    policy: Any
    platform: Platform
    machine: LiveMachine
    controller: Controller
    outputs: list[tuple[Output, Address]]


def run(command: ServeCommand) -> int:
    """Serve until it is stopped."""
    _check(command)
    print(
        f"making {command.policy} for {command.platform}; it takes some seconds", file=sys.stderr, flush=True
    )
    with ExitStack() as stack:
        with compilation_announced():
            served = _made(command)
        receivers: list[tuple[Any, Address]] = [*served.outputs]
        if command.view:
            from ..realtime.view import ViewFeed, watched

            address, url = stack.enter_context(
                watched(served.platform, command.policy, command.view_port, command.cpu)
            )
            receivers.append((ViewFeed(served.machine, command.rate), address))
            print(f"view: {url}")
        _serve(command, served, receivers)
    return 0


def _serve(command: ServeCommand, served: _Served, receivers: list[tuple[Any, Address]]) -> None:
    """Serve, and write what happened."""
    from ..realtime.packets import make_format
    from ..realtime.server import Endpoint, Server, address_of

    endpoint = Endpoint(address_of(command.host, command.port))
    try:
        server = Server(
            served.controller,
            endpoint,
            make_format(command.format),
            command.rate,
            command.lead,
            outputs=receivers,
        )
        _run(command, server, endpoint)
    finally:
        endpoint.close()
    _finish(command, served, server, endpoint)


def _check(command: ServeCommand) -> None:
    if command.duration is not None and not command.duration > 0.0:
        raise ConfigurationError(f"--duration must be positive, found {command.duration:g}")
    if not command.lead >= 0.0:
        raise ConfigurationError(f"--lead must not be negative, found {command.lead:g}")
    if command.log is not None and command.log.suffix != ".npz":
        raise ConfigurationError(f"--log {command.log}: a trajectory's file ends in .npz")
    for flag, file in (("--log", command.log), ("--report", command.report)):
        if file is not None:
            check_file(flag, file)
    if command.log is not None and command.log.exists():
        raise ConfigurationError(f"--log {command.log} is there already; move it away, or name another file")


def _made(command: ServeCommand) -> _Served:
    from ..envs.cues import CueScale
    from ..realtime.controller import Controller, ControllerOptions
    from ..realtime.guard import GuardOptions
    from ..realtime.inbox import CueBounds, Inbox
    from ..realtime.machine import make_machine
    from ..realtime.outputs import load_output
    from ..realtime.packets import make_format
    from ..realtime.server import address_of
    from ..realtime.watchdog import WatchdogOptions

    watchdog = WatchdogOptions(command.overdue, command.hold, command.stale, command.steady, command.fade)
    guard = GuardOptions(
        force_slew=command.max_jerk,
        vertical_slew=command.max_vertical_jerk,
        rate_slew=command.max_angular_acceleration,
        stuck=command.stuck,
        fade=command.fault_fade,
    )
    scale = CueScale.parse(command.scale)
    options = ControllerOptions(rate=command.rate, watchdog=watchdog, guard=guard, scale=scale)
    peer = address_of(command.peer, 0) if command.peer else None
    bounds = CueBounds(command.max_force, command.max_vertical, command.max_angular_velocity)
    inbox = Inbox(make_format(command.format), watchdog.stale, watchdog.overdue, peer, bounds)
    platform = arguments.find_platform(command.platform)
    written = [load_output(file, platform, command.rate) for file in command.output]
    outputs = [(output, address_of(output.template.to, 0)) for output in written]
    policy = arguments.make_policy(command.policy, platform, command.compensate)
    machine = make_machine(policy, platform, _VESTIBULAR, command.preview, command.predictor)
    return _Served(policy, platform, machine, Controller(machine, platform, inbox, options), outputs)


def _announce(command: ServeCommand, endpoint: Endpoint) -> None:
    from ..realtime.server import is_loopback

    host, port = endpoint.address
    print(f"{command.policy} on {command.platform}: UDP {host}:{port}, {command.rate} set-points a second")
    if not is_loopback(endpoint.address):
        who = f"only {command.peer} moves it" if command.peer else "whoever sends first moves it; see --peer"
        print(f"the network reaches {host}:{port}, beyond this machine: {who}")
    sys.stdout.flush()


@contextmanager
def terminated_gently() -> Iterator[None]:
    """Take SIGTERM for Ctrl-C within the block; only the main thread can."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    earlier = signal.signal(signal.SIGTERM, lambda number, frame: signal.raise_signal(signal.SIGINT))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, earlier)


def _run(command: ServeCommand, server: Server, endpoint: Endpoint) -> None:
    from ..envs.progress import Interrupt
    from ..realtime.timing import undisturbed

    interrupt, limit = Interrupt(), command.duration
    stopping = False

    def ends(seconds: float) -> bool:
        nonlocal stopping
        if not stopping and (interrupt.asked or (limit is not None and seconds >= limit)):
            stopping = True
            print("stopping: the machine brakes and returns to neutral ...", file=sys.stderr, flush=True)
        return stopping

    with interrupt.caught(), terminated_gently(), undisturbed(command.cpu, command.priority):
        # Whoever reads it may stop the controller at once.
        _announce(command, endpoint)
        try:
            server.run(ends)
        except KeyboardInterrupt:
            print("stopped before the machine was home", file=sys.stderr)


def _finish(command: ServeCommand, served: _Served, server: Server, endpoint: Endpoint) -> None:
    """Write the log and the report, and say what happened."""
    from ..realtime.report import show

    report = _report(command, served.controller, server, endpoint)
    show(report, "steps of 10 ms", command.report)
    log = served.controller.log
    if command.log is not None and len(log) < 2:
        print(f"--log {command.log} is not written: it ended within the first steps", file=sys.stderr)
    elif command.log is not None:
        log.trajectory(served.platform, served.machine.start, _VESTIBULAR, served.policy).save(command.log)


def _report(command: ServeCommand, controller: Controller, server: Server, endpoint: Endpoint) -> LoopReport:
    from ..evaluation.reporting.text import words_of
    from ..realtime.report import report_of
    from ..realtime.watchdog import State

    inbox, states = controller.inbox, controller.log.states
    return report_of(
        words_of("serve", command),
        server,
        periods=controller.periods,
        packets={**inbox.counts, "lost": inbox.lost, "unsent": endpoint.unsent},
        states={state: int((states == state).sum()) for state in State},
        faults=controller.faults,
        guard=controller.guard.counts,
    )


def run_drive(command: DriveCommand) -> int:
    """Drive; the exit status is 1 if nothing came back, or something outside of the limits."""
    from ..envs.progress import Interrupt
    from ..realtime.client import Client, NetworkFaults, cues_at
    from ..realtime.packets import make_format
    from ..realtime.server import Endpoint, address_of, is_loopback
    from ..realtime.timing import undisturbed

    _check_drive(command)
    trace = arguments.find_maneuver(command.maneuver, arguments.find_car(command.car))[1]()
    to = address_of(command.to, DEFAULT_PORT)
    network = NetworkFaults(command.drop, command.repeat, command.late, command.nan, command.seed)
    # From the loopback address nothing leaves this machine; other targets are reached from any.
    endpoint = Endpoint(("127.0.0.1" if is_loopback(to) else "0.0.0.0", 0))
    try:
        platform, form = arguments.find_platform(command.platform), make_format(command.format)
        client = Client(endpoint, to, form, platform, command.rate, network)
        interrupt = Interrupt()
        with interrupt.caught(), undisturbed(command.cpu):
            client.run(cues_at(trace, command.rate, command.times), lambda: interrupt.asked)
            client.listen(command.after)
    finally:
        endpoint.close()
    return _finish_drive(command, client, endpoint)


def _check_drive(command: DriveCommand) -> None:
    if command.rate < 1 or command.times < 1 or not 0.0 <= command.after < math.inf:
        raise ConfigurationError("--rate and --times must be at least 1, --after at least 0 and finite")
    if command.report is not None:
        check_file("--report", command.report)


def _finish_drive(command: DriveCommand, client: Client, endpoint: Endpoint) -> int:
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
    print(f"set-points outside the machine's limits: {client.counts['outside_limits']}")
    if client.braking:
        print(
            f"{client.braking:.1%} of the set-points came from a machine that braked while cues were sent: "
            "it was not yet back from an earlier drive, or packets were late; wait until it is in neutral "
            "(about 10 s), and drive again",
            file=sys.stderr,
        )
    return 1 if client.counts["outside_limits"] else 0
