"""`fba capture` and `fba send` over the loopback, and what they refuse."""

import json
import signal
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import fba
import fba.live.receiver
from command_line import Run
from fba.cli.main import main
from fba.face import resolve
from fba.live import Receiver
from fba.parameters import fap_numbers
from fba.serving import split_stream
from tools.captures.face_files import datagram

Arriving = Callable[[list[bytes]], None]
LOCAL = "127.0.0.1"


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind((LOCAL, 0))
        return int(one.getsockname()[1])


@pytest.fixture
def arriving(monkeypatch: pytest.MonkeyPatch) -> Callable[[list[bytes]], None]:
    """Say which datagrams wait for the next captures as soon as they listen: no sender has to be in time."""

    def send(data: list[bytes]) -> None:
        def listen(receiver: Receiver) -> Receiver:
            opened = enter(receiver)
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
                for one in data:
                    sender.sendto(one, (LOCAL, receiver.port))
            return opened

        monkeypatch.setattr(Receiver, "__enter__", listen)

    enter = Receiver.__enter__
    return send


def telephone(rows: int = 60, junk: bytes = b"junk") -> list[bytes]:
    """Datagrams of a face that smiles more and more, with junk between."""
    faces = [datagram([0.01 * (row % 90)] * 61, 100 + row / 60) for row in range(rows)]
    return [one for face in faces for one in (face, junk) if one]


SHORT = ("--seconds", 0.3)


def test_a_face_is_recorded_and_what_was_left_out_is_said(
    run: Run, arriving: Arriving, tmp_path: Path
) -> None:
    path, port = tmp_path / "a.fba", free_port()
    arriving(telephone())
    said = run("capture", "livelink", "--port", port, "--host", LOCAL, "-o", path, *SHORT)
    assert f"listening for Live Link Face on UDP port {port}" in said.err
    assert "receiving from 'iPhone' (127.0.0.1)" in said.err
    assert "120 datagrams from 'iPhone' (127.0.0.1): 60 used" in said.out
    assert "left out: 60 not of Live Link Face" in said.out
    assert "lost" not in said.out
    assert len(fba.read(path)) == 60
    assert "a.fba: 60 frames" in said.out
    said = run("capture", "livelink", "--port", port, "-o", path, *SHORT, "--json", "--fps", 25)
    values = json.loads(said.out)
    assert values["rate"] == "25"
    assert values["frames"] == len(fba.read(path))
    assert values["size"] == path.stat().st_size
    assert values["sender"] == "'iPhone' (127.0.0.1)"


def test_a_capture_at_a_bit_rate(run: Run, arriving: Arriving, tmp_path: Path) -> None:
    path, port = tmp_path / "a.fba", free_port()
    arriving(telephone(junk=b""))
    rate = ("--bitrate", "4kbit/s", "--buffer", "500ms")
    said = run("capture", "livelink", "--port", port, "-o", path, *SHORT, *rate, "--json")
    values = json.loads(said.out)
    held = values["bitrate"]
    assert (held["bits_per_second"], held["buffer"]) == (4000, 0.5)
    assert held["frames_left_out"] == values["frames"] - len(fba.read(path))
    assert 8 * path.stat().st_size <= 4000 * (values["frames"] / 60 + 0.5)
    said = run("capture", "livelink", "-o", path, "--bitrate", 1500, "--quant", 3, code=2)
    assert "--quant and --bitrate contradict each other" in said.err
    said = run("capture", "livelink", "-o", path, "--buffer", "2s", code=2)
    assert "--buffer goes with --bitrate" in said.err


def test_a_pipe_gets_a_stream_that_may_be_entered_anywhere(
    arriving: Arriving, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    """As `fba send -` wants it, whose receivers may lose packets: with an I plane every two seconds."""
    arriving(telephone(300, junk=b""))
    words = [
        "capture",
        "livelink",
        "--port",
        str(free_port()),
        "--host",
        LOCAL,
        "-o",
        "-",
        "--seconds",
        "0.3",
    ]
    with pytest.raises(SystemExit):
        main(words)
    stream = capsysbinary.readouterr().out
    planes, _ = split_stream(stream, "visage")
    assert len(planes) == 300
    assert [number for number, plane in enumerate(planes) if plane.opening] == [0, 120, 240]


def test_a_compact_capture_shows_the_same_with_less(run: Run, arriving: Arriving, tmp_path: Path) -> None:
    """Both sides of the telephone's face move alike: a compact stream leaves one of them to the player."""
    path, port, masks = tmp_path / "a.fba", free_port(), {}
    arriving(telephone(junk=b""))
    for preset in ("reference", "compact"):
        options = ("-o", path, *SHORT, "--preset", preset)
        run("capture", "livelink", "--port", port, "--host", LOCAL, *options)
        face = fba.read(path).face
        masks[preset] = face.mask[-1]
        shown = resolve(face)
        smiles = [fap_numbers()[f"raise_{side}_cornerlip"] - 1 for side in "lr"]
        assert shown[:, smiles[0]].any()
        assert (shown[:, smiles[0]] == shown[:, smiles[1]]).all()
    assert masks["reference"][smiles].all()
    assert masks["compact"][smiles].sum() == 1
    assert masks["compact"].sum() < 0.7 * masks["reference"].sum()
    said = run("capture", "livelink", "-o", path, "--bitrate", 1500, "--preset", "compact", code=2)
    assert "--preset and --bitrate contradict each other" in said.err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_it_with_the_file_complete(
    run: Run, arriving: Arriving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    """While datagrams are received; it has no other end."""
    drain = Receiver.drain
    sent: list[int] = []

    def drained(receiver: Receiver) -> None:
        drain(receiver)
        if receiver.capture.summary.received == 120 and not sent:
            sent.append(number)  # a second one would interrupt
            signal.raise_signal(number)

    monkeypatch.setattr(Receiver, "drain", drained)
    arriving(telephone())
    path = tmp_path / "a.fba"
    # A shell may have made tests that run in the background deaf to SIGINT.
    usual = signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
    before = signal.signal(number, usual)
    try:
        said = run("capture", "livelink", "--port", 0, "--host", LOCAL, "-o", path)
        assert signal.getsignal(number) is usual
    finally:
        signal.signal(number, before)
    assert len(fba.read(path)) == 60
    assert "60 frames" in said.out


def test_lost_datagrams_are_reported(
    run: Run, arriving: Arriving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fba.live.receiver, "BUFFER", 1)  # the system takes its smallest
    arriving(telephone())
    options = ("--port", 0, "--host", LOCAL, "-o", tmp_path / "a.fba", *SHORT)
    said = run("capture", "livelink", *options, "--json")
    values = json.loads(said.out)
    if values["dropped"] is None:
        pytest.skip("this system does not say what it dropped")
    assert values["dropped"] > 0
    assert values["received"] + values["dropped"] + values["unread"] == 120
    said = run("capture", "livelink", *options)
    assert f"lost because they came faster than they could be used: {values['dropped']} dropped" in said.out


def test_sent_faces_are_received(run: Run, arriving: Arriving, face: fba.Animation, tmp_path: Path) -> None:
    source, path, port = tmp_path / "face.fba", tmp_path / "a.fba", free_port()
    fba.write(source, face)
    from fba.live.sending import make_datagrams

    sent = list(make_datagrams(face, "Anna"))
    assert [round(at * 25) for at, _ in sent] == list(range(50))
    arriving([one for _, one in sent])
    run("capture", "livelink", "--port", port, "-o", path, *SHORT)
    back = fba.read(path)
    assert (back.rate, len(back)) == (25, 50)
    assert abs(back.face.values[:, 47] - face.face.values[:, 47]).max() <= 85  # half a step of head_pitch
    said = run("send", source, f"{LOCAL}:{port}", "--seconds", 0.2)
    assert said.out == f"5 frames sent to {LOCAL}, UDP port {port}\n"


def test_a_telephone_is_asked(run: Callable[..., Any], tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as phone:
        phone.bind((LOCAL, 0))
        phone.settimeout(60)
        ask = f"{LOCAL}:{phone.getsockname()[1]}"
        options = ["--port", free_port(), "--seconds", 0.15, "-o", tmp_path / "a.fba", "--ask", ask]
        assert "no datagram came on UDP port" in run("capture", "vtube", *options, code=1).err
        asked = json.loads(phone.recv(1000))
        assert (asked["messageType"], asked["ports"]) == ("iOSTrackingDataRequest", [options[1]])
        assert 0.5 <= asked["time"] <= 10
        assert 1 <= len(asked["sentBy"]) <= 32
        run("capture", "ifacialmocap", *options, code=1)
        assert phone.recv(1000).startswith(b"iFacialMocap_sahuasouryya9218sauhuiayeta91555dy3719")


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["livelink"], 2, "give -o OUT.fba to record, --play or --serve PORT to see it, or several"),
        (["livelink", "-o", "a.fba", "--model", "."], 2, "--model goes with --play"),
        (["livelink", "-o", "a.fba", "--ask", "10.0.0.2"], 2, "Live Link Face sends by itself"),
        (["vtube", "-o", "a.fba", "--ask", "10.0.0.2:x", "--seconds", "0.1"], 1, "'x' is not a port"),
        (
            ["livelink", "-o", "a.fba", "--host", "203.0.113.9", "--seconds", "0.1"],
            1,
            "cannot be listened on: Cannot assign requested address; give an address of this machine",
        ),
        (
            ["livelink", "-o", "a.fba", "--host", "300.1.1.1", "--seconds", "0.1"],
            1,
            "; give an address of this machine, or none for all",
        ),
        (["nothing", "-o", "a.fba"], 2, "is not one of"),
    ],
)
def test_contradictory_options_are_refused(
    run: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], code: int,
    text: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert text in run("capture", *arguments, "--port", free_port(), code=code).err


def test_nobody_but_another_sender_comes(run: Run, arriving: Arriving, tmp_path: Path) -> None:
    arriving(telephone())
    options = ("--port", 0, "-o", tmp_path / "a.fba", *SHORT, "--sender", "Bo")
    said = run("capture", "livelink", *options, code=1)
    assert "no face came" in said.err
    assert "'iPhone' (127.0.0.1)" in said.err
    assert not (tmp_path / "a.fba").exists()
