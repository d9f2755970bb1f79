"""Descriptions of sessions: written, read, and refused with the line that is wrong."""

import random

import pytest

from fba.carriage.payloads import SizeTable
from fba.carriage.sdp import MOST_BYTES, Session, read_sdp, write_sdp
from fba.errors import FormatError

HEADERS = bytes.fromhex("000001b061000001b523000001ba")
SESSION = Session("192.168.0.20", 5004, configuration=HEADERS, title="talk")
TEXT = write_sdp(SESSION)


@pytest.mark.parametrize(
    "session",
    [
        SESSION, Session("::1", 65_535, "6416", 127, HEADERS, title="a b"), Session("239.1.2.3", 1, "6416"),
        Session("ff15::1", 9, configuration=HEADERS),
    ],
)  # fmt: skip
def test_what_is_written_is_read(session: Session) -> None:
    assert read_sdp(write_sdp(session).encode()) == session


def test_the_lines() -> None:
    assert TEXT.split("\r\n") == [
        "v=0", "o=- 0 0 IN IP4 192.168.0.20", "s=talk", "c=IN IP4 192.168.0.20", "t=0 0",
        "m=video 5004 RTP/AVP 96", "a=rtpmap:96 mpeg4-generic/90000",
        "a=fmtp:96 profile-level-id=97; config=000001b061000001b523000001ba; streamType=4; objectType=32; "
        "mode=generic; sizeLength=13; indexLength=3; indexDeltaLength=3; randomAccessIndication=1", "",
    ]  # fmt: skip
    assert "c=IN IP4 239.1.2.3/1\r\n" in write_sdp(Session("239.1.2.3", 5004))
    with pytest.raises(ValueError, match="localhost"):
        write_sdp(Session("localhost", 5004))


def test_a_description_by_others() -> None:
    """Other order, other names, sound beside it, an address of its own for the medium."""
    text = (
        "v=0\no=jdoe 3724394400 3724394405 IN IP4 198.51.100.1\ns=Call\nc=IN IP4 198.51.100.1\nt=0 0\n"
        "m=audio 49170 RTP/AVP 0\na=rtpmap:0 PCMU/8000\n\n"
        "m=video 49180/2 RTP/AVP 26 98\nc=IN IP4 233.252.0.1/127/2\na=fmtp:98 SizeLength=16 ;MODE=generic\n"
        "a=rtpmap:98 MPEG4-generic/90000\na=recvonly\n"
    )
    found = read_sdp(text.encode())
    assert (found.host, found.port, found.kind, found.payload_type) == ("233.252.0.1", 49_180, "3640", 98)
    assert found.table == SizeTable(16, 0, 0, randomaccessindication=0)
    assert found.configuration == b""


@pytest.mark.parametrize(
    ("old", "new", "line", "finding"),
    [
        ("v=0", "v=1", 1, "v=0"), ("s=talk", "talk", 3, "a letter"), ("c=IN IP4 ", "c=IN IP4 x.", 4, "c=IN"),
        ("c=IN IP4 192.168.0.20\r\n", "", 5, "no address"), ("video 5004", "video 0", 6, "no port"),
        ("5004", "70000", 6, "a port"), ("AVP 96", "AVP 196", 6, "payload type"),
        ("/90000", "/8000", 7, "90000 Hz"), ("mpeg4-generic", "H264", 6, "no FBA stream"),
        ("rtpmap:96", "rtpmap:x", 7, "payload type"), ("streamType=4", "streamType=5", 8, "streamType"),
        ("config=00", "config=0", 8, "hexadecimal"), ("config=00", "config=" + "00" * 5000, 8, "hexadecimal"),
        ("sizeLength=13", "sizeLength=-1", 8, "a number"), ("sizeLength=13", "sizeLength=33", 8, "32 bits"),
        ("sizeLength=13", "sizeLength=0", 8, "constantSize"), ("m=video", "m=video 5004\r\nx=", 7, "no FBA"),
        ("m=video 5004 RTP/AVP 96\r\n", "", 7, "no medium"),
    ],
)  # fmt: skip
def test_mistakes(old: str, new: str, line: int, finding: str) -> None:
    with pytest.raises(FormatError, match=finding) as raised:
        read_sdp(TEXT.replace(old, new, 1).encode())
    assert raised.value.line is not None
    if old != "m=video":
        assert raised.value.line == line


def test_what_is_no_description() -> None:
    for data in (b"", b"\n", b"hello", b"\xff" * 100, b"v=0"):
        with pytest.raises(FormatError):
            read_sdp(data)
    with pytest.raises(FormatError, match="at most"):
        read_sdp(b"v=0\n" + bytes(MOST_BYTES))


def test_mutated_descriptions_raise_nothing_else() -> None:
    chance = random.Random(3)
    for _ in range(2000):
        data = bytearray(TEXT.encode())
        for _ in range(chance.randrange(1, 5)):
            data[chance.randrange(len(data))] = chance.randrange(256)
        try:
            read_sdp(bytes(data[: chance.randrange(len(data) + 1)] if chance.random() < 0.3 else data))
        except FormatError:
            continue
