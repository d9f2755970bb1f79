"""The kinds of live captures: their protocols, ports, and what asks for data."""

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

    name: as on the command line. description: who sends it. port: on which it is received by default.
    reader: makes a reader for one address. longest: bytes of the longest datagram that is looked at.
    asked_port: of the sender, on which it waits to be asked; 0 where it sends without. ask: returns what asks
    it to send to a port. ask_every: seconds. rate: frames in a second of the stream, where neither sender nor
    user says it; None: they are found in the first second. bodies: whether bones come, too.
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
    """Return a kind by its name; OptionError for another name."""
    names = [kind.name for kind in KINDS]
    if name not in names:
        raise OptionError(
            f"there is no live capture {name!r}{did_you_mean(name, names)}; there are {', '.join(names)}"
        )
    return KINDS[names.index(name)]
