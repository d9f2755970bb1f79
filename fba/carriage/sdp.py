"""Descriptions of sessions (SDP, RFC 8866) with one FBA stream."""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass
from typing import NoReturn

from fba.carriage.payloads import SIZE_TABLE, PayloadKind, SizeTable
from fba.carriage.rtp import CLOCK_RATE, PAYLOAD_TYPE
from fba.errors import FormatError

MOST_BYTES = 1 << 16
"""Longest description that is read."""
MOST_CONFIGURATION = 1 << 12
"""Most bytes of a configuration."""
_ENCODINGS: dict[str, PayloadKind] = {"mpeg4-generic": "3640", "mp4v-es": "6416"}
_NAMES = {"3640": "mpeg4-generic", "6416": "MP4V-ES"}
_EXPECTED = f"expected a=rtpmap with mpeg4-generic/{CLOCK_RATE} or MP4V-ES/{CLOCK_RATE}"


@dataclass(frozen=True)
class Session:
    """A session: where a stream is sent to, and how it is coded.

    host: address of the receiver, or of a group. kind: RFC of the payload. configuration: headers of the
    stream; b"" if unknown. table: fields of AU headers. title: of the stream.
    """

    host: str
    port: int
    kind: PayloadKind = "3640"
    payload_type: int = PAYLOAD_TYPE
    configuration: bytes = b""
    table: SizeTable = SIZE_TABLE
    title: str = "FBA"


def write_sdp(session: Session) -> str:
    """Return the description of a session, whose host is an address. Raises ValueError for a name."""
    address = ipaddress.ip_address(session.host)
    where = f"IN IP{address.version} {address}"
    limited = "/1" if address.is_multicast and address.version == 4 else ""
    number = session.payload_type
    profile = session.configuration[4] if len(session.configuration) > 4 else 0x61
    parameters = {"profile-level-id": str(profile), "config": session.configuration.hex()}
    if session.kind == "3640":
        fields = session.table
        parameters |= {
            "streamType": "4", "objectType": "32", "mode": "generic", "sizeLength": str(fields.sizelength),
            "indexLength": str(fields.indexlength), "indexDeltaLength": str(fields.indexdeltalength),
            "randomAccessIndication": str(fields.randomaccessindication),
        }  # fmt: skip
    title = " ".join(session.title.split()) or "FBA"
    lines = (
        "v=0", f"o=- 0 0 {where}", f"s={title}", f"c={where}{limited}", "t=0 0",
        f"m=video {session.port} RTP/AVP {number}",
        f"a=rtpmap:{number} {_NAMES[session.kind]}/{CLOCK_RATE}",
        f"a=fmtp:{number} " + "; ".join(f"{name}={value}" for name, value in parameters.items()),
    )  # fmt: skip
    return "".join(f"{line}\r\n" for line in lines)


def read_sdp(data: bytes) -> Session:
    """Return the first FBA stream of a description. Raises FormatError, which says in which line."""
    if len(data) > MOST_BYTES:
        raise FormatError(f"is {len(data)} bytes long; a description of a session has at most {MOST_BYTES}")
    lines = data.decode("utf-8", "replace").splitlines()
    if not lines or lines[0].strip() != "v=0":
        raise FormatError("is no description of a session: the first line is not v=0", line=1)
    reader = _Reader()
    for number, line in enumerate(lines, 1):
        if line.strip():
            reader.read(line.strip(), number)
    return reader.session(len(lines))


class _Media:
    """A medium of a session, as far as it was read: a line is its text and its number."""

    def __init__(self, line: int, port: int, payload_types: list[int]) -> None:
        self.line = line
        self.port = port
        self.payload_types = payload_types
        self.host = ""
        self.maps: dict[int, tuple[str, int]] = {}
        self.formats: dict[int, tuple[str, int]] = {}


class _Reader:
    """Reads lines of a description."""

    def __init__(self) -> None:
        self._host = self._title = ""
        self._media: list[_Media] = []

    def read(self, text: str, line: int) -> None:
        kind, equals, value = text[:1], text[1:2], text[2:]
        if equals != "=" or not kind.isalpha():
            raise FormatError("expected a letter, = and a value", line=line, token=text)
        if kind == "s":
            self._title = value
        elif kind == "c":
            self._read_address(value, line)
        elif kind == "m":
            self._read_media(value, line)
        elif kind == "a" and self._media:
            name, _, rest = value.partition(":")
            number, _, rest = rest.partition(" ")
            if name in ("rtpmap", "fmtp"):
                target = self._media[-1].maps if name == "rtpmap" else self._media[-1].formats
                target[_number(number, range(128), "a payload type", line)] = rest.strip(), line

    def _read_address(self, value: str, line: int) -> None:
        match = re.fullmatch(r"IN IP[46] ([^ /]+)(?:/[\d/]+)?", value)
        try:
            host = str(ipaddress.ip_address(match[1])) if match else ""
        except ValueError:
            host = ""
        if not host:
            raise FormatError("expected c=IN IP4 and an address", line=line, token=value)
        if self._media:
            self._media[-1].host = host
        else:
            self._host = host

    def _read_media(self, value: str, line: int) -> None:
        words = value.split()
        if len(words) < 4 or not words[2].startswith("RTP/"):
            self._media.append(_Media(line, 0, []))  # another kind of medium
            return
        port = _number(words[1].partition("/")[0], range(65_536), "a port", line)
        numbers = [_number(word, range(128), "a payload type", line) for word in words[3:]]
        self._media.append(_Media(line, port, numbers))

    def session(self, last_line: int) -> Session:
        """Return the first stream that can be read. last_line: of the description."""
        for media in self._media:
            for number in media.payload_types:
                encoding, line = media.maps.get(number, ("", media.line))
                name, _, rate = encoding.partition("/")
                kind = _ENCODINGS.get(name.lower())
                if kind is None:
                    continue
                if rate != str(CLOCK_RATE):
                    raise FormatError(f"a clock of {CLOCK_RATE} Hz is expected", line=line, token=encoding)
                return self._session(media, number, kind)
        if not self._media:
            raise FormatError(f"describes no medium: expected a line m=video; {_EXPECTED}", line=last_line)
        raise FormatError(f"describes no FBA stream: {_EXPECTED}", line=self._media[0].line)

    def _session(self, media: _Media, number: int, kind: PayloadKind) -> Session:
        text, line = media.formats.get(number, ("", media.line))
        host = media.host or self._host
        if not host or not media.port:
            raise FormatError("says no address or no port for the stream", line=media.line)
        parameters = {}
        for part in text.split(";"):
            name, _, value = part.strip().partition("=")
            parameters[name.strip().lower()] = value.strip()
        if kind == "3640" and parameters.get("streamtype", "4") != "4":
            _refuse("streamType", parameters["streamtype"], "4, a visual stream", line)
        configuration = parameters.get("config", "")
        if (
            not re.fullmatch(r"(?:[0-9a-fA-F]{2})*", configuration)
            or len(configuration) > 2 * MOST_CONFIGURATION
        ):
            _refuse("config", configuration, "bytes in hexadecimal", line)
        return Session(
            host, media.port, kind, number, bytes.fromhex(configuration), _table(parameters, kind, line),
            self._title,
        )  # fmt: skip


def _table(parameters: dict[str, str], kind: PayloadKind, line: int) -> SizeTable:
    """Return the fields of AU headers: those that are not named have no bits."""
    if kind != "3640":
        return SIZE_TABLE
    widths = {}
    for name in vars(SIZE_TABLE):
        value = parameters.get(name, "0")
        if not (value.isascii() and value.isdecimal() and len(value) < 6):
            _refuse(name, value, "a number", line)
        widths[name] = int(value)
    try:
        return SizeTable(**widths)
    except ValueError as error:
        raise FormatError(f"a=fmtp: {error}", line=line) from error


def _number(text: str, allowed: range, what: str, line: int) -> int:
    if text.isascii() and text.isdecimal() and len(text) < 6 and int(text) in allowed:
        return int(text)
    raise FormatError(f"expected {what}, {allowed.start} to {allowed.stop - 1}", line=line, token=text)


def _refuse(name: str, value: str, expected: str, line: int) -> NoReturn:
    raise FormatError(f"a=fmtp: {name} must be {expected}", line=line, token=value)
