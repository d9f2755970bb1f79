"""`Server`: a port with a page and streams, in a thread."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import os
import secrets
import socket
import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from fba.errors import FbaError
from fba.serving._channel import Channel
from fba.serving._gate import Gate
from fba.serving._pacing import Stage
from fba.serving._planes import Plane

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

DEFAULT_PORT = 8080
LOCAL = "127.0.0.1"
MOST_VIEWERS = 200
LONGEST_MESSAGE = 125
"""Bytes of a message from a viewer: those of a control frame. None is expected."""
SEND_BUFFER = 1 << 14
"""Bytes that the system is asked to hold for a viewer: what waits there is late."""
OPEN_SECONDS = 10.0
"""Seconds within which a request must be complete."""
CLOSE_SECONDS = 2.0
"""Seconds that a viewer has to answer when the server closes."""
CHECK_SECONDS = 0.05
"""Seconds after which `wait` looks again whether there is anything to wait for."""
NORMAL, GOING_AWAY, POLICY = 1000, 1001, 1008
"""Codes with which connections close."""


class Server:
    """Serves a page and streams; a context manager, which works in a thread.

    page: HTML that needs no other file. titles: of the streams. host: address to listen on; by default that
    which only this computer reaches. If it is given, a random token is part of `url`, and required. port: 0
    for any free port. most_viewers: at once.

    Raises FbaError, on entering, where the port cannot be opened, and without the package websockets.
    """

    def __init__(
        self,
        page: bytes,
        titles: Sequence[str],
        *,
        host: str | None = None,
        port: int = DEFAULT_PORT,
        most_viewers: int = MOST_VIEWERS,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        try:
            from websockets.asyncio.server import broadcast
        except ImportError:
            raise FbaError(
                'streams are sent to browsers by the package websockets: pip install "mpeg4-fba[serve]"'
            ) from None
        self.host = host or LOCAL
        self.port = port
        self.token = "" if host is None else secrets.token_urlsafe(16)
        self._clock = clock
        self._close_code = GOING_AWAY
        self._gate = Gate(page, len(titles), token=self.token, most_viewers=most_viewers, clock=clock)
        self.channels: list[Channel[Any]] = [
            Channel(titles, number, broadcast, lambda viewer: viewer.transport.get_write_buffer_size())
            for number in range(len(titles))
        ]
        self._loop: asyncio.AbstractEventLoop
        self._closing: asyncio.Event
        self._stopped = threading.Event()
        self._showing = 0  # sources that have not ended
        self._failure: Exception | None = None

    @property
    def url(self) -> str:
        """Address of the page."""
        name = socket.gethostname() if self.host in ("0.0.0.0", "::") else self.host
        shown = f"[{name}]" if ":" in name else name
        return f"http://{shown}:{self.port}/" + (f"{self.token}/" if self.token else "")

    def __enter__(self) -> Server:
        self._socket = listen(self.host, self.port)
        self.port = int(self._socket.getsockname()[1])
        ready = threading.Event()
        self._thread = threading.Thread(
            target=lambda: asyncio.run(self._serve(ready)), name="fba serve", daemon=True
        )
        self._thread.start()
        ready.wait()
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        self._close_code = GOING_AWAY if kind is not None or self._stopped.is_set() else NORMAL
        self._stopped.set()
        self._loop.call_soon_threadsafe(self._closing.set)
        self._thread.join()

    def stage(self, number: int) -> Stage:
        """Return a stream as its source sees it."""
        return _ChannelStage(self.channels[number], self._loop, self._stopped, self._clock)

    def start(self, number: int, source: Callable[[Stage], None]) -> None:
        """Show a stream, from a new thread. source: returns at the end of it, or when the server stops."""

        def run() -> None:
            try:
                source(self.stage(number))
            except Exception as error:  # raised again by `wait`
                self._failure = self._failure or error
            self._showing -= 1

        self._showing += 1
        threading.Thread(target=run, name=f"fba stream {number}", daemon=True).start()

    def wait(self) -> None:
        """Wait until all sources have ended, or `stop`. Raises the error of a source."""
        while self._showing and not self._failure and not self._stopped.is_set():
            time.sleep(CHECK_SECONDS)  # a lock could be what a signal handler waits for
        if self._failure is not None:
            raise self._failure

    def stop(self) -> None:
        """End `wait` and the sources, from any thread or a signal handler."""
        self._stopped.set()

    async def _serve(self, ready: threading.Event) -> None:
        from websockets.asyncio.server import serve

        self._loop = asyncio.get_running_loop()
        self._closing = asyncio.Event()
        async with serve(
            self._watch, sock=self._socket, process_request=self._answer, compression=None,
            max_size=LONGEST_MESSAGE, open_timeout=OPEN_SECONDS, close_timeout=CLOSE_SECONDS,
            server_header=None, logger=_silent_logger(),
        ) as server:  # fmt: skip
            ready.set()
            await self._closing.wait()
            server.close(code=self._close_code)
            await server.wait_closed()

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request; None for one that may go on to a stream, or that no browser makes."""
        from websockets.datastructures import Headers
        from websockets.http11 import Response

        if request.method != "GET":
            return None
        viewers = sum(channel.viewers for channel in self.channels)
        refused = self._gate.answer(request.path, request.headers.get_all, viewers)
        if refused is None:
            return None
        headers = {**refused.headers, "Content-Length": str(len(refused.body)), "Connection": "close"}
        return Response(refused.status.value, refused.status.phrase, Headers(headers), refused.body)

    async def _watch(self, connection: ServerConnection) -> None:
        """Show a stream to a viewer until the connection closes."""
        from websockets.exceptions import ConnectionClosed

        request = connection.request
        number = None if request is None else self._gate.stream_of(request.path)
        if number is None:
            return
        opened = connection.transport.get_extra_info("socket")
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        channel = self.channels[number]
        channel.join(connection)
        try:
            await connection.recv()
            await connection.close(POLICY, "viewers send nothing")
        except ConnectionClosed:
            pass
        finally:
            channel.leave(connection)


class _ChannelStage:
    """A channel as a `Stage`, for one other thread."""

    def __init__(
        self,
        channel: Channel[Any],
        loop: asyncio.AbstractEventLoop,
        stopped: threading.Event,
        clock: Callable[[], float],
    ) -> None:
        self._channel = channel
        self._loop = loop
        self._stopped = stopped
        self.clock = clock
        self.wait = stopped.wait

    @property
    def viewers(self) -> int:
        return self._channel.viewers

    @property
    def newcomers(self) -> int:
        return self._channel.newcomers

    def publish(self, plane: Plane) -> None:
        self._call(self._channel.publish, plane)

    def end(self, ending: bytes) -> None:
        self._call(self._channel.end, ending)

    def _call(self, function: Callable[[Any], None], value: object) -> None:
        with contextlib.suppress(RuntimeError):  # the server has closed
            self._loop.call_soon_threadsafe(function, value)


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens for connections. Raises FbaError."""
    try:
        family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        return socket.create_server(address[:2], family=family)
    except OSError as error:
        where = f"{host}, port {port}: cannot be listened on"
        reason = error.strerror if isinstance(error, socket.gaierror) else os.strerror(error.errno or 0)
        remedy = "give another port, or close the program that uses it"
        if isinstance(error, socket.gaierror) or error.errno == errno.EADDRNOTAVAIL:
            remedy = "give an address of this computer, such as 0.0.0.0 for all of them"
        elif error.errno == errno.EACCES:
            remedy = "give a port above 1023"
        raise FbaError(f"{where}: {reason}; {remedy}") from error


def _silent_logger() -> logging.Logger:
    """Return a logger that drops what strangers make a server say, such as words on broken requests."""
    logger = logging.Logger("fba.serving")
    logger.addHandler(logging.NullHandler())
    return logger
