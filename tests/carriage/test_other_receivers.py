"""Packets as other programs read them: tshark dissects each, FFmpeg takes the planes out of RFC 6416."""

import shutil
import socket
import struct
import subprocess
import threading
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from fba.carriage.payloads import full_configuration, write_start_codes
from fba.carriage.sdp import Session, write_sdp
from fba.carriage.sending import units_of
from rtp_network import Packets, packets_of, planes_of, stream

PORT = 52_004
PLANES = planes_of(stream(100))
TSHARK = shutil.which("tshark")


def write_pcap(path: Path, packets: Packets) -> None:
    """Write a capture file of UDP datagrams (raw IPv4)."""
    data = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65_535, 228)
    for sent, payload in packets:
        length = 28 + len(payload)
        head = struct.pack(">BBHHHBBH4s4s", 0x45, 0, length, 0, 0, 64, 17, 0, b"\x7f\0\0\1", b"\x7f\0\0\1")
        udp = struct.pack(">HHHH", PORT + 1, PORT, 8 + len(payload), 0)
        data += struct.pack("<IIII", int(sent), int(sent % 1 * 1e6), length, length) + head + udp + payload
    path.write_bytes(data)


def dissected(path: Path, *arguments: str) -> list[list[str]]:
    """Return fields that tshark finds, a row a packet."""
    assert TSHARK is not None
    command = [TSHARK, "-r", str(path), "-d", f"udp.port=={PORT},rtp", *arguments]
    found = subprocess.run(command, capture_output=True, text=True, check=True)
    return [line.split("\t") for line in found.stdout.splitlines()]


@pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")
@pytest.mark.parametrize("kind", ["3640", "6416"])
@pytest.mark.parametrize("planes_per_packet", [1, 5])
def test_tshark_dissects_every_packet(tmp_path: Path, kind: str, planes_per_packet: int) -> None:
    packets = packets_of(PLANES, kind=kind, planes_per_packet=planes_per_packet)
    write_pcap(tmp_path / "a.pcap", packets)
    decode = ["-d", "rtp.pt==96,mp4v-es"] if kind == "6416" else []
    names = (
        "rtp.version", "rtp.p_type", "rtp.seq", "rtp.timestamp", "rtp.ssrc", "rtp.marker", "_ws.malformed",
    )  # fmt: skip
    fields = [part for name in names for part in ("-e", name)]
    rows = dissected(tmp_path / "a.pcap", *decode, "-T", "fields", *fields)
    assert len(rows) == len(packets)
    for number, (version, kind_of_payload, sequence, _, source, marker, malformed) in enumerate(rows):
        assert (version, kind_of_payload, int(source, 16)) == ("2", "96", 7)
        assert int(sequence) == (65_000 + number) % 65_536
        assert marker in ("1", "True")
        assert not malformed
    times = [int(row[3]) for row in rows[:-3]]
    steps = {(after - before) % 2**32 for before, after in pairwise(times)}
    assert steps <= {3600 * count for count in range(1, planes_per_packet + 1)}
    expert = dissected(tmp_path / "a.pcap", *decode, "-Y", "_ws.expert.severity >= warning")
    assert expert == []


@pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")
def test_tshark_names_the_headers_of_rfc_6416(tmp_path: Path) -> None:
    write_pcap(tmp_path / "a.pcap", packets_of(PLANES, kind="6416"))
    found = dissected(tmp_path / "a.pcap", "-d", "rtp.pt==96,mp4v-es", "-V", "-c", "1")
    text = "\n".join("\t".join(row) for row in found)
    assert "Simple Face Animation Profile/Level 1" in text
    assert "FBA ID" in text


def test_ffmpeg_takes_the_planes_out_of_rfc_6416(tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    with socket.socket(type=socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = int(free.getsockname()[1])
    configuration = full_configuration(PLANES[0].configuration)
    session = Session("127.0.0.1", port, "6416", configuration=configuration)
    (tmp_path / "a.sdp").write_text(write_sdp(session), newline="")
    packets = [data for _, data in packets_of(PLANES, kind="6416", finish=False)]
    contents = {3600 * number: write_start_codes(units_of(plane)) for number, plane in enumerate(PLANES)}
    done = threading.Event()

    def send() -> None:
        with socket.socket(type=socket.SOCK_DGRAM) as sender:
            while not done.is_set():  # FFmpeg drops what comes before it listens
                for packet in packets:
                    if done.wait(0.002):
                        return
                    sender.sendto(packet, ("127.0.0.1", port))

    sending = threading.Thread(target=send)
    sending.start()
    options = {
        "protocol_whitelist": "file,rtp,udp", "fflags": "noparse+nobuffer+nofillin", "probesize": "32",
        "analyzeduration": "1",
    }  # fmt: skip
    try:
        with av.open(str(tmp_path / "a.sdp"), options=options, timeout=60) as opened:
            codec: Any = opened.streams[0].codec_context
            assert (codec.name, codec.profile) == ("mpeg4", "Simple Face Animation Profile")
            assert codec.extradata == configuration
            found = []
            for packet in opened.demux():
                found.append(bytes(packet))
                if len(found) == 20:
                    break
    finally:
        done.set()
        sending.join()
    first = list(contents.values()).index(found[0])
    assert found == list(contents.values())[first : first + 20]
