"""Streams over real sockets of the loopback, and what is said where there is none."""

import random
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import pytest

import fba
from fba.carriage.payloads import PayloadKind, full_configuration
from fba.carriage.rtp import write_frame
from fba.carriage.sdp import Session
from fba.errors import FbaError
from fba.live.addresses import StreamAddress, parse_address
from fba.live.streams import MOST_CONNECTIONS, Pacer, StreamReceiver, StreamSender, repeated
from rtp_network import END, packets_of, planes_of, stream

LOCAL = "127.0.0.1"
DATA = stream(60)
SENT = fba.decode(DATA)
PLANES = planes_of(DATA)


def free_port(kind: int) -> int:
    with socket.socket(type=kind) as opened:
        opened.bind((LOCAL, 0))
        return int(opened.getsockname()[1])


def address(scheme: str, host: str = LOCAL) -> StreamAddress:
    kind = socket.SOCK_STREAM if scheme == "tcp" else socket.SOCK_DGRAM
    return parse_address(f"{scheme}://{host}:{free_port(kind)}")


class Counting:
    """A pace without pauses."""

    def __init__(self) -> None:
        self.now = 0.0

    def clock(self) -> float:
        return self.now

    def wait(self, seconds: float) -> bool:
        self.now += seconds
        return False


def whole(receiver: StreamReceiver) -> fba.Animation:
    parts = []
    while part := receiver.read1():
        parts.append(part)
    return fba.decode(b"".join([*parts, END]))


def send_for_ever(sender: StreamSender) -> None:
    while True:
        sender.send(PLANES[0], 0.0)


@contextmanager
def sending(send: Callable[[], None]) -> Iterator[None]:
    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        thread.join()


@pytest.mark.parametrize("scheme", ["rtp", "tcp", "udp"])
@pytest.mark.parametrize("kind", ["3640", "6416"])
def test_a_stream_arrives_as_it_was_sent(scheme: str, kind: PayloadKind) -> None:
    target = address(scheme)

    def send() -> None:
        with StreamSender(target, kind=kind, planes_per_packet=2) as sender:
            for plane, seconds in repeated(PLANES, Counting()):
                sender.send(plane, seconds)
            sender.finish()

    with StreamReceiver(target, wait=60) as receiver, sending(send):
        assert whole(receiver) == SENT
        assert (receiver.counts.planes, receiver.counts.seconds) == (60, 2.4)


def test_a_description_says_how_it_is_coded() -> None:
    target = address("rtp")
    configuration = full_configuration(PLANES[0].configuration)
    session = Session(target.host, target.port, "6416", 111, configuration)
    packets = packets_of(PLANES, kind="6416", payload_type=111)
    with StreamReceiver(session, wait=60) as receiver, socket.socket(type=socket.SOCK_DGRAM) as sender:
        for _, data in packets:
            sender.sendto(data, target[1:])
        assert whole(receiver) == SENT


def test_multicast() -> None:
    target = address("rtp", "239.255.11.7")
    try:
        with StreamReceiver(target, wait=5) as receiver, StreamSender(target) as sender:
            for plane in PLANES:
                sender.send(plane, plane.time)
            sender.finish()
            shown = whole(receiver)
    except FbaError as error:
        pytest.skip(f"no multicast in this network: {error}")
    assert shown == SENT


def test_losses_are_said() -> None:
    target = address("rtp")
    packets = packets_of(PLANES)
    said: list[str] = []
    with StreamReceiver(target, delay=0.0) as receiver, socket.socket(type=socket.SOCK_DGRAM) as sender:
        receiver.say = said.append
        for number, (_, data) in enumerate(packets):
            if number != 30:
                sender.sendto(data, target[1:])
                receiver._receive(60.0)
                receiver._tell()
    assert said == ["packets lost, 1 so far: the pose is held", "packets lost, 1 so far: it goes on"]


def test_strangers_on_a_connection() -> None:
    """Connections that send nothing, or nonsense, take no place; there are only so many."""
    target = address("tcp")
    chance = random.Random(2)
    packets = b"".join(write_frame(data) for _, data in packets_of(PLANES, finish=False))
    with StreamReceiver(target, wait=60) as receiver, ExitStack() as stack:
        strangers = []
        for _ in range(MOST_CONNECTIONS - 1):
            one = stack.enter_context(socket.create_connection(target[1:]))
            one.sendall(write_frame(chance.randbytes(100)) + chance.randbytes(1))
            strangers.append(one)
        sender = stack.enter_context(socket.create_connection(target[1:]))
        sender.sendall(packets)
        sender.close()  # without an end code: it ends nevertheless
        assert whole(receiver) == SENT
        assert sum(receiver.counts.refused.values()) == MOST_CONNECTIONS - 1


def test_a_stream_that_does_not_come() -> None:
    target = address("rtp")
    with (
        StreamReceiver(target, wait=0.05) as receiver,
        pytest.raises(FbaError, match="no stream came; check that the sender"),
    ):
        receiver.read1()
    with StreamReceiver(target, wait=0.2) as receiver, socket.socket(type=socket.SOCK_DGRAM) as sender:
        sender.sendto(b"hello", target[1:])
        with pytest.raises(FbaError, match="of which decoding could begin: 1 packets, 0 planes; left out: 1"):
            receiver.read1()


def test_stop_from_another_thread() -> None:
    receiver = StreamReceiver(address("rtp"))
    with receiver, sending(receiver.stop):
        assert receiver.read1() == b""


def test_mistakes_of_receivers() -> None:
    with socket.socket(type=socket.SOCK_DGRAM) as taken:
        taken.bind((LOCAL, 0))
        used = parse_address(f"rtp://{LOCAL}:{taken.getsockname()[1]}")
        with pytest.raises(FbaError, match=r"cannot be listened on.*close the program"):
            StreamReceiver(used).__enter__()
    with socket.create_server((LOCAL, 0)) as listening:
        used = parse_address(f"tcp://{LOCAL}:{listening.getsockname()[1]}")
        with pytest.raises(FbaError, match=r"cannot be listened on.*another port"):
            StreamReceiver(used).__enter__()
    with pytest.raises(FbaError, match="give an address of this machine"):
        StreamReceiver(parse_address("rtp://192.0.2.1:5004")).__enter__()


def test_mistakes_of_senders() -> None:
    with pytest.raises(FbaError, match="start a receiver first, such as `fba play tcp://"):
        StreamSender(address("tcp")).__enter__()
    with pytest.raises(FbaError, match=r"cannot be sent to.*give the address of a computer"):
        StreamSender(parse_address("rtp://no.such.host.invalid:5004")).__enter__()
    with socket.create_server((LOCAL, 0)) as listening:
        target = parse_address(f"tcp://{LOCAL}:{listening.getsockname()[1]}")
        with StreamSender(target) as sender:
            taken, _ = listening.accept()
            taken.close()
            with pytest.raises(FbaError, match="the receiver has closed the connection") as raised:
                send_for_ever(sender)
            assert raised.value.__cause__ is None


def test_nobody_listens_to_datagrams() -> None:
    """A receiver may come later: that is no error."""
    with StreamSender(address("rtp")) as sender:
        for plane in PLANES:
            sender.send(plane, plane.time)
        sender.finish()
        assert sender.packets == 63


@pytest.mark.parametrize(
    "text",
    ["rtp://", "rtp://a", "rtp://a:0", "rtp://a:65536", "rtp://a:5004/x", "rtp://a:b:5004", "rtp://[::1]",
     "http://a:80", "rtp:a:5004", "RTP://a:1", "rtp://a:5004?x", "rtp://a:٣"],
)  # fmt: skip
def test_what_is_no_address(text: str) -> None:
    with pytest.raises(FbaError, match="expected rtp://HOST:PORT"):
        parse_address(text)


def test_addresses() -> None:
    for text in ("rtp://192.168.0.20:5004", "udp://[::1]:1", "tcp://:65535", "rtp://a.example:5004"):
        assert str(parse_address(text)) == text
        assert parse_address(text.replace("//", "/")) == parse_address(text)  # as a path


def test_a_file_again_and_again() -> None:
    pace = Counting()
    times = []
    for _, seconds in repeated(PLANES[:25], pace, loop=True):
        times.append(seconds)
        if len(times) == 60:
            break
    assert times == pytest.approx([number / 25 for number in range(60)])
    assert pace.now == pytest.approx(59 / 25)


def test_a_pacer_stops() -> None:
    now = [0.0]
    pacer = Pacer(1.0, clock=lambda: now[0])
    now[0] = 1.0
    assert pacer.wait(0.5)
    assert not Pacer().wait(0.0)
    stopped = Pacer()
    stopped.stop()
    assert stopped.wait(100)


def test_a_window_shows_what_arrives() -> None:
    """The animation that `fba play` shows: it grows with the planes, and says that some are missing."""
    live_module = pytest.importorskip("fba_player.playback.live")
    target = address("rtp")
    packets = [data for _, data in packets_of(PLANES, finish=False)]
    with (
        StreamReceiver(target, wait=60, delay=0.0) as receiver,
        socket.socket(type=socket.SOCK_DGRAM) as sender,
    ):
        live = live_module.LiveAnimation(receiver, name=str(target), bap_steps="auto")
        receiver.say = live.tell
        for data in [*packets[:30], packets[31]]:
            sender.sendto(data, target[1:])
        assert live.wait(60)
        while not live.message:
            threading.Event().wait(0.005)
        assert live.message == "packets lost, 1 so far: the pose is held"
        for data in [*packets[32:], packets_of(PLANES)[-1][1]]:
            sender.sendto(data, target[1:])
        assert live.wait_end(60)
        assert live.index.tolist() == [*range(30), *range(50, 60)]
        live.close()
