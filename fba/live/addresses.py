"""Addresses of streams: rtp://HOST:PORT, udp://HOST:PORT, tcp://HOST:PORT."""

from __future__ import annotations

import re
from typing import Literal, NamedTuple, cast

from fba.errors import FbaError

Scheme = Literal["rtp", "udp", "tcp"]
_ADDRESS = re.compile(r"(rtp|udp|tcp)://?(?:\[([^\]]*)\]|([^:/\[\]]*)):([0-9]{1,5})/?")


class StreamAddress(NamedTuple):
    """Where a stream is sent to. host: "" for all addresses of the receiver."""

    scheme: Scheme
    host: str
    port: int

    def __str__(self) -> str:
        shown = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{shown}:{self.port}"


def parse_address(text: str) -> StreamAddress:
    """Return an address, which as a path has lost one of its two slashes. FbaError for another text."""
    match = _ADDRESS.fullmatch(text)
    port = int(match[4]) if match else 0
    if match is None or not 0 < port < 65_536:
        raise FbaError(
            f"{text}: is not the address of a stream; expected rtp://HOST:PORT, udp://HOST:PORT or "
            "tcp://HOST:PORT, with a port from 1 to 65535"
        )
    return StreamAddress(cast("Scheme", match[1]), match[2] or match[3] or "", port)
