"""The controller's machine in a browser: a process of its own, which the loop feeds and never waits for.

The loop sends a datagram some thirty times a second to a port of this machine: as any other output, without
blocking, and without an answer. A full buffer, a slow browser or the end of the process lose frames, and
nothing else.
"""

from __future__ import annotations

import os
import signal
import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, Final

import numpy as np

from ..envs.errors import MotionCueingError
from ..envs.platform import Platform
from .machine import LiveMachine
from .packets import MOTION, SetPoint
from .watchdog import State

FRAMES: Final = 30
"""Frames a second."""
_NICE: Final = 10
"""Priority that the process leaves to others."""
_FRAME: Final = struct.Struct("<qd9d6d6d")
"""State, time, positions, reference cue, simulator cue."""
_PATIENCE: Final = 1.0
"""Time after which a stream looks whether its page is still there, s."""
_BEGIN: Final = 60.0
"""Time in which the process must have begun, s."""
STATES: Final = {
    State.NEUTRAL: "At rest: no cues come.",
    State.RUNNING: "Running: the policy follows the cues.",
    State.HOLDING: "Holding: the newest cues are overdue.",
    State.BRAKING: "Braking and returning to neutral.",
}


class ViewFeed:
    """Writes what the page shows of a set-point; the server sends it as an output.

    Args:
        machine: Has the cues.
        rate: Set-points a second.

    Attributes:
        every: Set-points from one datagram to the next.
    """

    def __init__(self, machine: LiveMachine, rate: int) -> None:
        self._machine, self.every = machine, max(1, round(rate / FRAMES))

    def datagram(self, setpoint: SetPoint) -> bytes:
        """The datagram of a set-point."""
        simulated = self._machine.now.state[0]["simulator_cue"]
        return _FRAME.pack(
            int(setpoint.state),
            setpoint.sent,
            *setpoint.motion[MOTION["position"]],
            *self._machine.reference_cue,
            *simulated["force"],
            *simulated["rate"],
        )


class Frames:
    """The newest frame, and whoever waits for the next."""

    def __init__(self) -> None:
        self._news = threading.Condition()
        self._newest: dict[str, Any] | None = None
        self._count = 0

    def take(self, data: bytes) -> None:
        """A datagram; one of another length is left out."""
        if len(data) != _FRAME.size:
            return
        numbers = _FRAME.unpack(data)
        frame = {
            "state": numbers[0],
            "time": numbers[1],
            "position": numbers[2:11],
            "reference": numbers[11:17],
            "simulated": numbers[17:23],
        }
        if not np.isfinite(numbers[1:]).all():
            return
        with self._news:
            self._newest, self._count = frame, self._count + 1
            self._news.notify_all()

    def stream(self) -> Iterator[dict[str, Any]]:
        """The newest frame, again and again; frames that came in between are left out."""
        seen = 0
        while True:
            with self._news:
                if self._count == seen:
                    self._news.wait(_PATIENCE)
                frame, seen = self._newest, self._count
            if frame is not None:
                yield frame


@contextmanager
def watched(
    platform: Platform, policy: str, port: int = 0, cpu: int | None = None
) -> Iterator[tuple[Any, str]]:
    """A process that shows a machine, as long as the block lasts.

    Args:
        platform: The machine.
        policy: Name of the policy, for the page.
        port: Of the page; 0 for any that is free.
        cpu: Core of the loop, which the process leaves alone.

    Yields:
        Where :class:`ViewFeed` is to be sent, and the address of the page.

    Raises:
        MotionCueingError: the process does not begin, as the port is in use.
    """
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_show, args=(theirs, platform, policy, port, cpu), daemon=True)
    process.start()
    theirs.close()
    try:
        try:
            found = ours.recv() if ours.poll(_BEGIN) else None
        except EOFError:
            found = None
        if not isinstance(found, tuple):
            raise MotionCueingError(f"--view: the page cannot be served: {found or 'it did not begin'}")
        yield found
    finally:
        process.terminate()
        process.join()


def _show(pipe: Connection, platform: Platform, policy: str, port: int, cpu: int | None) -> None:
    """The process: receive datagrams, and serve the page."""
    from ..evaluation.reporting.view.page import render_live
    from ..evaluation.reporting.view.server import PageServer, Routes

    # Ctrl-C is for the controller, which ends this process when it is done.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    _step_back(cpu)
    frames = Frames()
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", 0))
    page = render_live(platform, policy, {int(state): text for state, text in STATES.items()})
    try:
        server = PageServer(Routes(lambda: page, streams={"/frames": frames.stream}), port)
    except OSError as error:
        pipe.send(f"port {port}: {error.strerror}")
        return

    def receive() -> None:
        while True:
            frames.take(receiver.recv(2 * _FRAME.size))

    threading.Thread(target=receive, daemon=True).start()
    pipe.send((receiver.getsockname(), server.url))
    server.serve_forever()


def _step_back(cpu: int | None) -> None:
    """Leave the processor, and the core of the loop, to others where the system lets us."""
    if hasattr(os, "nice"):
        os.nice(_NICE)
    if cpu is not None and hasattr(os, "sched_setaffinity"):
        others = os.sched_getaffinity(0) - {cpu}
        if others:
            os.sched_setaffinity(0, others)
