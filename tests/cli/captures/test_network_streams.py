"""`fba send`, `fba capture` and `fba serve` with addresses: streams over the loopback, and mistakes."""

import json
import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import fba
from command_line import Run
from fba.carriage.sdp import Session, read_sdp, write_sdp
from fba.codec import encode_animation
from fba.errors import FbaError
from fba.live.addresses import parse_address
from fba.live.streams import Pacer, StreamReceiver
from joinable_streams import performance
from rtp_network import END, PERIOD, packets_of, planes_of, stream

LOCAL = "127.0.0.1"


def said_by(result: Any) -> str:
    return str(result.out + result.err)


def free_address(scheme: str = "rtp") -> str:
    kind = socket.SOCK_STREAM if scheme == "tcp" else socket.SOCK_DGRAM
    with socket.socket(type=kind) as one:
        one.bind((LOCAL, 0))
        return f"{scheme}://{LOCAL}:{one.getsockname()[1]}"


@pytest.fixture
def arriving(monkeypatch: pytest.MonkeyPatch) -> Callable[[list[bytes]], None]:
    """Say which datagrams wait for the next receivers as soon as they listen: no sender has to be in time."""

    def send(data: list[bytes]) -> None:
        def listen(receiver: StreamReceiver) -> StreamReceiver:
            opened = enter(receiver)
            with socket.socket(type=socket.SOCK_DGRAM) as sender:
                for one in data:
                    sender.sendto(one, (LOCAL, receiver.address.port))
            return opened

        monkeypatch.setattr(StreamReceiver, "__enter__", listen)

    enter = StreamReceiver.__enter__
    return send


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Send without pauses."""

    def wait(pacer: Pacer, seconds: float) -> bool:
        pacer.now = getattr(pacer, "now", 0.0) + seconds  # type: ignore[attr-defined]
        pacer.clock = lambda: pacer.now  # type: ignore[attr-defined]
        return False

    monkeypatch.setattr(Pacer, "wait", wait)


@pytest.mark.parametrize("body", [False, True])
def test_a_stream_is_recorded_as_it_is(
    run: Run, arriving: Callable[[list[bytes]], None], tmp_path: Path, body: bool
) -> None:
    data = stream(60, body=body)
    packets = [one for _, one in packets_of(planes_of(data, body=body))]
    arriving([b"junk", *packets[:30], *packets[31:]])
    file = tmp_path / "a.fba"
    result = run("capture", free_address(), "-o", file, "--wait", 60, "--delay", 0)
    shown, sent = fba.read(file), fba.decode(data)
    assert shown.index.tolist() == [*range(30), *range(50, 60)]
    for part in ("face", "body"):
        one, other = getattr(shown, part), getattr(sent, part)
        assert (one is None) == (other is None)
        if one is not None:
            assert (one.values == other.values[shown.index]).all()
    assert "1 lost" in said_by(result)
    assert "the pose was held once, until the next I plane, for 0.80 s at most" in said_by(result)
    assert "left out: 1 shorter than an RTP header" in said_by(result)
    assert f"{file}: 40 planes, 2.40 s, {file.stat().st_size} bytes" in said_by(result)
    marked = "the time code 0:00:02 says that 20 frames are missing before this plane; 20 frames lost"
    assert marked in said_by(run("verify", file, code=1))


def test_counts_for_programs(run: Run, arriving: Callable[[list[bytes]], None], tmp_path: Path) -> None:
    packets = [one for _, one in packets_of(planes_of(stream(30)))]
    arriving(packets)
    result = run("capture", free_address(), "-o", tmp_path / "a.fba", "--json", "--wait", 60)
    counts = json.loads(result.out)
    assert (counts["planes"], counts["lost"], counts["seconds"]) == (30, 0, 1.2)
    assert counts["size"] == (tmp_path / "a.fba").stat().st_size


def test_a_description_in_place_of_an_address(
    run: Run, arriving: Callable[[list[bytes]], None], tmp_path: Path
) -> None:
    address = parse_address(free_address())
    session = Session(LOCAL, address.port, "6416", 100)
    (tmp_path / "a.sdp").write_text(write_sdp(session), newline="")
    arriving([one for _, one in packets_of(planes_of(stream(30)), kind="6416", payload_type=100)])
    run("capture", tmp_path / "a.sdp", "-o", tmp_path / "a.fba", "--wait", 60)
    assert len(fba.read(tmp_path / "a.fba")) == 30
    (tmp_path / "bad.sdp").write_text("v=0\ns=x\n")
    failed = run("capture", tmp_path / "bad.sdp", "-o", tmp_path / "b.fba", code=1)
    assert "bad.sdp: line 2: describes no medium" in said_by(failed)
    assert not (tmp_path / "b.fba").exists()


@pytest.mark.usefixtures("at_once")
@pytest.mark.parametrize("scheme", ["rtp", "udp", "tcp"])
def test_a_file_is_sent(run: Run, tmp_path: Path, scheme: str) -> None:
    """A stream of one I plane gets others, with the same values."""
    file = tmp_path / "a.fba"
    animation = performance(60, body=False)
    file.write_bytes(encode_animation(animation)[0])
    address = free_address(scheme)
    found: list[bytes] = []
    with StreamReceiver(parse_address(address), wait=60) as receiver:

        def receive() -> None:
            while part := receiver.read1():
                found.append(part)

        thread = threading.Thread(target=receive)
        thread.start()
        result = run("send", file, address, "--planes-per-packet", 2)
        thread.join()
    assert fba.decode(b"".join([*found, END])) == fba.read(file)
    assert receiver.counts.planes == 60
    assert "2 planes a packet: up to 40 ms later" in said_by(result)
    assert "a.fba has one I plane: sent with one every 1 s, the same values" in said_by(result)
    assert f"60 planes sent to {address}" in said_by(result)


@pytest.mark.usefixtures("at_once")
def test_the_description_that_is_written(run: Run, tmp_path: Path) -> None:
    file, sdp = tmp_path / "talk.fba", tmp_path / "talk.sdp"
    file.write_bytes(encode_animation(performance(30), PERIOD)[0])
    address = free_address()
    run("send", file, address, "--sdp", sdp, "--payload", "6416")
    session = read_sdp(sdp.read_bytes())
    assert (session.host, session.kind, session.title) == (LOCAL, "6416", "talk")
    assert f"{LOCAL}:{session.port}" in address
    assert b"bap_steps=visage" in session.configuration


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("send {file} rtp://127.0.0.1", "expected rtp://HOST:PORT"),
        ("send {file} rtp://127.0.0.1:5004 --name A", "--name is for receivers of Live Link Face"),
        ("send {file} 127.0.0.1 --payload 6416", "--payload goes with an address such as rtp://"),
        ("send {file} 127.0.0.1 --planes-per-packet 2", "--planes-per-packet goes with an address"),
        ("send {file} tcp://127.0.0.1:5004 --sdp a.sdp", "--sdp describes streams by RTP"),
        ("send {file} udp://127.0.0.1:5004 --payload 6416", "--payload is for RTP"),
        ("send - rtp://127.0.0.1:5004 --loop", "--loop repeats a file"),
        ("send {file} rtp://127.0.0.1:5004 --live", "--live goes with standard input"),
        ("send {file} rtp://no.such.host.invalid:5004", "cannot be sent to"),
        ("capture rtp://127.0.0.1:5004", "give -o OUT.fba to record"),
        ("capture rtp://127.0.0.1 -o a.fba", "expected rtp://HOST:PORT"),
        ("capture rtp://127.0.0.1:5004 -o a.fba --neutral 1", "--neutral goes with livelink"),
        ("capture rtp://127.0.0.1:5004 -o a.fba --quant 2", "--quant goes with livelink"),
        ("capture livelink -o a.fba --delay 3", "--delay goes with a stream from a network"),
        ("capture livelnk -o a.fba", "did you mean 'livelink'?"),
        ("capture rtp://192.0.2.1:5004 -o a.fba", "cannot be listened on"),
        ("serve {file} --wait 3", "--wait goes with a stream from a network"),
        ("play {file} --wait 3", "--wait goes with a stream from a network"),
    ],
)  # fmt: skip
def test_mistakes(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str, said: str) -> None:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "in.fba"
    file.write_bytes(stream(5))
    result = run(*words.format(file=file).split(), code=None)
    assert result.code in (1, 2)
    assert said in " ".join(said_by(result).split())
    assert [path.name for path in tmp_path.iterdir()] == ["in.fba"]


def test_no_stream(run: Run, tmp_path: Path) -> None:
    result = run("capture", free_address(), "-o", tmp_path / "a.fba", "--wait", 0.05, code=1)
    assert "no stream came; check that the sender" in said_by(result)
    result = run("capture", free_address(), "-o", tmp_path / "a.fba", "--seconds", 0.05, code=1)
    assert "no stream came" in said_by(result)
    assert not (tmp_path / "a.fba").exists()


def test_a_port_that_is_used(run: Run, tmp_path: Path) -> None:
    with socket.socket(type=socket.SOCK_DGRAM) as taken:
        taken.bind((LOCAL, 0))
        address = f"rtp://{LOCAL}:{taken.getsockname()[1]}"
        result = run("capture", address, "-o", tmp_path / "a.fba", code=1)
    assert "close the program that uses it" in said_by(result)
    with pytest.raises(FbaError):
        parse_address("rtp:")
