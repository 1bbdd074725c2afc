"""A UDP socket that is waited on until a deadline, to the microsecond."""

from __future__ import annotations

import ipaddress
import select
import socket
import time
from collections.abc import Callable
from typing import Final

from ...envs.errors import ConfigurationError
from .inbox import Address
from .packets import LARGEST

_SPIN: Final = 100_000
"""Before a deadline, ns, in which the socket is asked again and again: the system wakes nobody so exactly."""

_MOST_WAITING: Final = 32
"""Datagrams that are taken after the deadline: a flood must not stop the clock."""


class Endpoint:
    """Sends and receives datagrams; what the network refuses is lost, as datagrams are.

    Args:
        address: Host and port to listen at; port 0 for any that is free.

    Attributes:
        address: Host and port it listens at.
        unsent: Datagrams the network refused.

    Raises:
        ConfigurationError: the address is none of this machine's, or taken.
    """

    def __init__(self, address: Address) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind(address)
        except (OSError, OverflowError) as error:
            self._socket.close()
            raise ConfigurationError(
                f"{address[0]}:{address[1]} cannot be listened at ({error}); name another host or port"
            ) from None
        self._socket.setblocking(False)
        self.address: Address = self._socket.getsockname()
        self.unsent = 0

    def close(self) -> None:
        """Listen no more."""
        self._socket.close()

    def send(self, data: bytes, to: Address) -> None:
        """Send a datagram."""
        try:
            self._socket.sendto(data, to)
        except OSError:
            self.unsent += 1

    def listen(
        self,
        deadline: int,
        take: Callable[[bytes, Address, int], object],
        clock: Callable[[], int] = time.perf_counter_ns,
    ) -> None:
        """Receive until a deadline, ns; after it, what has come already, but not without end.

        Args:
            deadline: Of the clock.
            take: Given each datagram, who sent it, and when it came, ns.
            clock: Nanoseconds now.
        """
        waiting = 0
        while True:
            now = clock()
            try:
                data, sender = self._socket.recvfrom(LARGEST + 1)
            except OSError:
                if now >= deadline:
                    return
                if deadline - now > _SPIN:
                    select.select([self._socket], [], [], 1e-9 * (deadline - now - _SPIN))
                continue
            take(data, sender, now)
            waiting += now >= deadline
            if waiting >= _MOST_WAITING:
                return


def address_of(text: str, port: int) -> Address:
    """Host and port of ``HOST`` or ``HOST:PORT``.

    Args:
        text: A name or IPv4 address.
        port: Where none is said.

    Raises:
        ConfigurationError: there is no host, or none of this name, or the port is no number from 0 to 65535.
    """
    host, colon, said = text.partition(":")
    if colon and not (said.isascii() and said.isdigit()):
        raise ConfigurationError(f"{text}: a port is a number, as in 127.0.0.1:{port}")
    if not host:
        # The system would take it for 0.0.0.0, every address of this machine.
        raise ConfigurationError(f"{text!r}: name a host, as in 127.0.0.1:{port}")
    number = int(said) if colon else port
    if number > 65535:
        raise ConfigurationError(f"{text}: a port is at most 65535")
    try:
        return socket.gethostbyname(host), number
    except (OSError, UnicodeError):
        raise ConfigurationError(f"{text}: there is no host {host!r}") from None


def is_loopback(address: Address) -> bool:
    """Whether only programs of this machine reach an address."""
    return ipaddress.ip_address(address[0]).is_loopback
