"""A server for pages on this machine alone: files, answers to a page's questions, and streams of events.

It listens on the loopback address. A request that names another host is refused, so that no page of the web
can reach it by a name that leads here; so is one with data from another page.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Final

from ....envs.errors import MotionCueingError

_LARGEST: Final = 1 << 20
"""Of a request's data, bytes."""
_HOSTS: Final = ("127.0.0.1", "localhost")


@dataclass(frozen=True)
class Routes:
    """What a server answers, by path.

    Args:
        page: HTML of the path ``/``, made when it is requested.
        answers: Answers as JSON; each is called with the data of the request, None where there are none.
            A :class:`~motion_cueing.envs.errors.MotionCueingError` becomes ``{"error": its sentence}``.
        streams: Streams of events, each an iterator of JSON; it ends when the page is closed.
    """

    page: Callable[[], str]
    answers: Mapping[str, Callable[[Any], Any]] = field(default_factory=dict)
    streams: Mapping[str, Callable[[], Iterator[Any]]] = field(default_factory=dict)


class PageServer(ThreadingHTTPServer):
    """Serves routes on the loopback address.

    Args:
        routes: What it answers.
        port: To listen at; 0 for any that is free.

    Raises:
        OSError: the port is in use.
    """

    daemon_threads = True

    def __init__(self, routes: Routes, port: int = 0) -> None:
        self.routes = routes
        super().__init__((_HOSTS[0], port), _Handler)

    @property
    def url(self) -> str:
        """Its address for a browser."""
        return f"http://{_HOSTS[0]}:{self.server_address[1]}/"


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: PageServer

    def log_message(self, format: str, *args: Any) -> None:
        """Requests are not logged."""

    def do_GET(self) -> None:
        """The page, an answer, or a stream."""
        if not self._is_ours():
            return
        path = self.path.partition("?")[0]
        routes = self.server.routes
        if path == "/":
            self._send(HTTPStatus.OK, "text/html; charset=utf-8", routes.page().encode())
        elif path in routes.streams:
            self._stream(routes.streams[path]())
        else:
            self._answer(path, None)

    def do_POST(self) -> None:
        """An answer to data."""
        if not self._is_ours():
            return
        length = int(self.headers.get("Content-Length") or 0)
        origin = self.headers.get("Origin")
        if length > _LARGEST or origin not in (None, f"http://{self.headers.get('Host')}"):
            self.close_connection = True
            self._send(HTTPStatus.FORBIDDEN, "text/plain", b"")
            return
        try:
            data = json.loads(self.rfile.read(length) or b"null")
        except ValueError:
            self._send(HTTPStatus.BAD_REQUEST, "text/plain", b"")
            return
        self._answer(self.path, data)

    def _is_ours(self) -> bool:
        host = (self.headers.get("Host") or "").rpartition(":")[0]
        if host not in _HOSTS:
            self.close_connection = True
            self._send(HTTPStatus.FORBIDDEN, "text/plain", b"")
        return host in _HOSTS

    def _answer(self, path: str, data: Any) -> None:
        answer = self.server.routes.answers.get(path)
        if answer is None:
            self._send(HTTPStatus.NOT_FOUND, "text/plain", b"")
            return
        try:
            content = answer(data)
        except MotionCueingError as error:
            content = {"error": " ".join(str(error).split())}
        text = json.dumps(content, allow_nan=False, separators=(",", ":"))
        self._send(HTTPStatus.OK, "application/json", text.encode())

    def _send(self, status: HTTPStatus, kind: str, content: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(content)

    def _stream(self, events: Iterator[Any]) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Cache-Control", "no-store")
        self.send_header("Connection", "close")
        self.end_headers()
        self.close_connection = True
        try:
            for event in events:
                self.wfile.write(f"data: {json.dumps(event, separators=(',', ':'))}\n\n".encode())
                self.wfile.flush()
        except OSError:
            # The page is closed.
            return
