"""The kinds of live captures: their protocols, ports and requests for data."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from fba.errors import OptionError, did_you_mean
from fba.live._protocols.ifacialmocap import FacialMocapReader
from fba.live._protocols.livelink import LiveLinkReader
from fba.live._protocols.sample import DatagramReader
from fba.live._protocols.vmc import VmcReader
from fba.live._protocols.vtube import VTubeReader


@dataclass(frozen=True)
class Kind:
    """A kind of live capture.

    name: as on the command line. description: the sender. port: the default port of the receiver. reader:
    makes a reader for one address. longest: size of the longest accepted datagram, bytes. asked_port: port on
    which the sender waits for requests; 0 if it needs none. ask: returns the request to send to a port.
    ask_every: seconds between requests. rate: frame rate of the stream where neither sender nor user gives
    one; None: that of the first second. bodies: whether bones are sent.
    """

    name: str
    description: str
    port: int
    reader: Callable[[], DatagramReader]
    longest: int
    asked_port: int = 0
    ask: Callable[[int], bytes] = lambda _port: b""
    ask_every: float = 0.0
    rate: Fraction | None = Fraction(60)
    bodies: bool = False


def _ask_vtube(port: int) -> bytes:
    return json.dumps(
        {"messageType": "iOSTrackingDataRequest", "time": 5, "sentBy": "fba", "ports": [port]}
    ).encode()


def _ask_ifacialmocap(_port: int) -> bytes:
    return b"iFacialMocap_sahuasouryya9218sauhuiayeta91555dy3719|sendDataVersion=v2"


KINDS = (
    Kind("livelink", "Live Link Face", 11111, LiveLinkReader, 2048),
    Kind(
        "ifacialmocap", "iFacialMocap", 49983, FacialMocapReader, 16_384,
        asked_port=49983, ask=_ask_ifacialmocap, ask_every=2.0,
    ),
    Kind(
        "vtube", "VTube Studio", 11125, VTubeReader, 32_768,
        asked_port=21412, ask=_ask_vtube, ask_every=1.0,
    ),
    Kind("vmc", "a VMC performer", 39539, VmcReader, 65_535, rate=None, bodies=True),
)  # fmt: skip
"""All kinds."""


def find_kind(name: str) -> Kind:
    """Return the kind with a name; OptionError for an unknown name."""
    names = [kind.name for kind in KINDS]
    if name not in names:
        raise OptionError(
            f"there is no live capture {name!r}{did_you_mean(name, names)}; there are {', '.join(names)}"
        )
    return KINDS[names.index(name)]
