"""`Gate`: which requests a server answers, and with what."""

from __future__ import annotations

import base64
import gzip
import hmac
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from http import HTTPStatus
from urllib.parse import urlsplit

LOCAL_NAMES = ("127.0.0.1", "localhost", "::1")
"""Names of this computer, as browsers on it call it."""
REQUESTS_PER_SECOND = 20
"""Requests that are answered for long; for short, as many as there may be viewers come on top."""
_SCRIPT = re.compile(rb"<script\b[^>]*>(.*?)</script", re.DOTALL | re.IGNORECASE)


@dataclass(frozen=True)
class Answer:
    """An answer: its status, what it holds, and its headers."""

    status: HTTPStatus
    body: bytes
    headers: Mapping[str, str]


class Gate:
    """Decides on requests. Nothing but one page and the streams can be reached.

    page: HTML that needs no other file. streams: their number. token: if not empty, required as the first
    part of each path; if empty, requests must be addressed to this computer by one of its local names, which
    pages from elsewhere cannot bring about. most_viewers: at once. clock: monotonic, in seconds.
    """

    def __init__(
        self, page: bytes, streams: int, *, token: str, most_viewers: int, clock: Callable[[], float]
    ) -> None:
        self._streams = streams
        self._token = token
        self._most_viewers = most_viewers
        self._clock = clock
        self._allowance, self._counted_at = float(most_viewers + REQUESTS_PER_SECOND), clock()
        shown = {"Content-Type": "text/html; charset=utf-8", **security_headers(page)}
        packed = shown | {"Content-Encoding": "gzip", "Vary": "Accept-Encoding"}
        self._page = Answer(HTTPStatus.OK, page, shown)
        self._packed_page = Answer(HTTPStatus.OK, gzip.compress(page), packed)

    def answer(self, path: str, headers: Callable[[str], Sequence[str]], viewers: int) -> Answer | None:
        """Return the answer to a request; None where it may watch a stream.

        path: as it was sent. headers: returns all headers of a name. viewers: number of those who watch.
        """
        if not self._is_allowed():
            return refusal(HTTPStatus.TOO_MANY_REQUESTS, "too many requests; try again in a second")
        hosts, origins = headers("Host"), headers("Origin")
        if len(hosts) != 1 or not (self._token or host_name(hosts[0]) in LOCAL_NAMES):
            return refusal(HTTPStatus.MISDIRECTED_REQUEST, "this server does not have that name")
        if self._without_token(path) == "/":
            packed = any("gzip" in value for value in headers("Accept-Encoding"))
            return self._packed_page if packed else self._page
        if self.stream_of(path) is None:
            return refusal(HTTPStatus.NOT_FOUND, "there is nothing here")
        if len(origins) > 1 or any(urlsplit(origin).netloc != hosts[0] for origin in origins):
            return refusal(HTTPStatus.FORBIDDEN, "pages of other servers may not watch this stream")
        if viewers >= self._most_viewers:
            return refusal(HTTPStatus.SERVICE_UNAVAILABLE, f"all {self._most_viewers} places are taken")
        return None

    def stream_of(self, path: str) -> int | None:
        """Return the number of the stream at a path; None without a stream, or with a wrong token."""
        match = re.fullmatch(r"/stream(?:\?n=(\d{1,4}))?", self._without_token(path), re.ASCII)
        number = -1 if match is None else int(match[1] or 0)
        return number if 0 <= number < self._streams else None

    def _without_token(self, path: str) -> str:
        """Return a path behind its token; "" where that is wrong."""
        if not self._token:
            return path
        given, slash, rest = path.removeprefix("/").partition("/")
        right = hmac.compare_digest(given.encode("utf-8", "replace"), self._token.encode())
        return slash + rest if right and path.startswith("/") else ""

    def _is_allowed(self) -> bool:
        """Whether one more request may be answered now."""
        now, most = self._clock(), float(self._most_viewers + REQUESTS_PER_SECOND)
        passed = now - self._counted_at
        self._allowance, self._counted_at = min(self._allowance + passed * REQUESTS_PER_SECOND, most), now
        if self._allowance < 1:
            return False
        self._allowance -= 1
        return True


def refusal(status: HTTPStatus, text: str) -> Answer:
    """Return the answer to a request that is not met."""
    retry = {"Retry-After": "1"} if status == HTTPStatus.TOO_MANY_REQUESTS else {}
    headers = {"Content-Type": "text/plain; charset=utf-8", **security_headers(b""), **retry}
    return Answer(status, f"{text}\n".encode(), headers)


def security_headers(page: bytes) -> dict[str, str]:
    """Return headers that let a page run the scripts that stand in it, and nothing else."""
    hashes = (base64.b64encode(sha256(text).digest()).decode() for text in _SCRIPT.findall(page))
    scripts = " ".join(f"'sha256-{one}'" for one in dict.fromkeys(hashes)) or "'none'"
    policy = (
        "default-src 'none'", f"script-src {scripts}", "style-src 'unsafe-inline'", "img-src data: blob:",
        "media-src data: blob:", "font-src data:", "connect-src 'self' data: blob:", "base-uri 'none'",
        "form-action 'none'", "frame-ancestors 'none'",
    )  # fmt: skip
    return {
        "Content-Security-Policy": "; ".join(policy),
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Cache-Control": "no-store",
    }


def host_name(host: str) -> str:
    """Return the name in a `Host` header, without the port; "" for nonsense."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""
