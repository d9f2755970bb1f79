"""`fba capture`: receive, show and record the data of a telephone or a program."""

from __future__ import annotations

import queue
import sys
import threading
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from fba.cli import options
from fba.cli.coding import rate_options
from fba.cli.coding.clamped_values import clamped_lines
from fba.cli.command import Command, examples
from fba.cli.inputs import read_model
from fba.cli.interruptions import raise_delayed, stopping
from fba.cli.live_streams import (
    ADDRESSES,
    DESCRIPTION,
    HOST_HELP,
    INTRA_PERIOD,
    Receiving,
    SourceType,
    StreamTarget,
    network_source,
    open_server,
)
from fba.cli.option_fields import option, option_like, with_options
from fba.cli.outputs import STANDARD, Output, Outputs, display_name, output_option
from fba.cli.printing import rate_text, seconds_text
from fba.encoder_options import QUANT_MAX, EncoderOptions
from fba.errors import FbaError, did_you_mean

if TYPE_CHECKING:
    from fba.live import Capture, Kind, Receiver, StreamRecorder, Summary
    from fba.live.recording import Target
    from fba.serving import Server
    from fba.tracks import BodyTrack, FaceTrack

KINDS = ("livelink", "ifacialmocap", "vtube", "vmc")
_OF_KINDS = (
    "port", "host", "ask", "sender", "rate", "neutral", "swap", "preset", "fap_quant", "bit_rate", "buffer",
)  # fmt: skip
"""Options that only the protocols of telephones and programs have."""
LONGEST_NEUTRAL = 60.0
"""Seconds."""


class _KindType(SourceType):
    """A protocol, or where a stream comes from; both as text."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if str(value) in KINDS:
            return str(value)
        if "://" not in str(value) and not str(value).lower().endswith(DESCRIPTION):
            near = did_you_mean(str(value), KINDS)
            self.fail(
                f"{value!r} is not one of {', '.join(KINDS)}{near}, nor an address such as {ADDRESSES}, nor "
                f"FILE{DESCRIPTION}",
                param,
                ctx,
            )
        return super().convert(value, param, ctx).as_posix()


@dataclass(frozen=True, kw_only=True)
class _Network:
    """Where data come from: see `fba.live.Receiver`."""

    port: int | None = option(
        type=click.IntRange(0, 65_535),
        help="UDP port to listen on; 0: any that is free. Default: 11111 for livelink, 49983 for "
        "ifacialmocap, 11125 for vtube, 39539 for vmc.",
    )
    host: str = option(
        default="", metavar="ADDRESS", help="Own address to listen on. Default: all of this computer's."
    )
    ask: str | None = option(
        metavar="ADDRESS[:PORT]",
        help="Telephone to ask for data: vtube needs it; ifacialmocap can be told our address in the app.",
    )
    sender: str | None = option(
        "--sender", "--subject", metavar="NAME",
        help="Of several senders, the one to use: its subject's name or its address. Default: the first.",
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class _Coding:
    """How the stream is coded: by a preset and a quantiser, or at a bit rate with a buffer in seconds."""

    preset: Literal["reference", "compact"] | None = option(
        help="What is sent: all that comes (reference, the default), or only what players do not derive from "
        "other FAPs, and nothing that never moved so far (compact)."
    )
    fap_quant: int = option_like(EncoderOptions, "fap_quant", "--quant", type=click.IntRange(0, QUANT_MAX))
    bit_rate: float | None = rate_options.bit_rate_option
    buffer: float = rate_options.buffer_option

    @property
    def is_compact(self) -> bool:
        """Whether FAPs that players derive are left out."""
        return self.preset == "compact"

    def recorder(self, targets: list[Target], *, served: bool) -> StreamRecorder:
        """Return the encoder that writes frames to the targets. served: for viewers who come later."""
        from fba.live import StreamRecorder

        return StreamRecorder(
            targets,
            EncoderOptions(
                fap_quant=self.fap_quant,
                clamp=True,
                bap_steps="visage",
                start_codes=served,
                intra_period=INTRA_PERIOD if served else None,
            ),
            bit_rate=self.bit_rate,
            buffer=self.buffer,
            compact=self.is_compact,
            prompt=served,
        )


@dataclass(frozen=True, kw_only=True)
class _Request:
    """What the command line asks for."""

    kind: str
    output: Path | None = output_option("OUT.fba", "Stream to write while it comes; - for standard output.")
    no_clobber: bool = options.no_clobber_option
    play: bool = option(default=False, help="Show it in a window.")
    serve: int | None = option(
        type=click.IntRange(0, 65_535), metavar="PORT",
        help="Show it in browsers, on this TCP port; 0: any that is free. See `fba serve`.",
    )  # fmt: skip
    serve_host: str | None = option(metavar="ADDRESS", help=f"With --serve: {HOST_HELP}")
    network: _Network
    receiving: Receiving
    seconds: Fraction | None = option(
        type=options.PERIOD, metavar="SECONDS", help="Stop after that; default: on Ctrl-C."
    )
    rate: Fraction | None = options.rate_option(
        "Frame rate of the stream. Default: the sender's own, else 60; vmc: that of its first second."
    )
    neutral: float | None = option(
        type=options.FloatRange(0, LONGEST_NEUTRAL, min_open=True),
        metavar="SECONDS",
        help="The first seconds show the neutral face: their median is subtracted. vmc: the first moment is "
        "a T-pose. Default: all counts as it is sent.",
    )
    swap: bool = option(default=False, help="MouthLeft and MouthRight, JawLeft and JawRight change places.")
    coding: _Coding
    model: Path | None = options.model_option(
        "With --play, the face that is shown. Default: the built-in head."
    )
    as_json: bool = options.json_option


@click.command(
    cls=Command,
    epilog=examples(
        "fba capture livelink -o face.fba",
        "fba capture livelink --play --subject Anna",
        "fba capture livelink -o face.fba --preset compact",
        "fba capture livelink -o face.fba --bitrate 1500",
        "fba capture ifacialmocap --ask 192.168.0.20 -o face.fba --seconds 60",
        "fba capture vtube --ask 192.168.0.20 --play",
        "fba capture vmc -o person.fba",
        "fba capture livelink --serve 8080",
        "fba capture rtp://0.0.0.0:5004 -o talk.fba",
    ),
)
@click.argument("kind", type=_KindType(), metavar=f"[{'|'.join(KINDS)}|{ADDRESSES}|FILE{DESCRIPTION}]")
@with_options
def command(request: _Request) -> None:
    """Receive a captured face or person over the network, show it, and record it as an FBA stream.

    livelink is Live Link Face, ifacialmocap also Facemotion3d, vtube VTube Studio on a telephone, vmc any
    program that performs by the VMC protocol, bodies too. An address of this computer, or a description of
    a session, stands for a stream that `fba send` or another program sends; it is recorded as it comes. The
    file is complete at any moment, whatever happens to this program. Ctrl-C ends it and prints what was
    received, and what was left out.
    """
    _check(request)
    output, network, coding = request.output, request.network, request.coding
    written = [] if output is None else [Output("-o", output)]
    outputs = Outputs(written, [request.model], no_clobber=request.no_clobber)
    if request.play:
        from fba import player

        player.check_display()  # before work that takes long
    if request.kind not in KINDS:
        _record(request, outputs)
        return
    from fba.live import find_kind
    from fba.live.recording import warm_up

    kind = find_kind(request.kind)
    if network.ask is not None and not kind.asked_port:
        raise click.UsageError(f"--ask: {kind.description} sends by itself; enter our address in the app")
    tried = [] if request.serve is None else [StreamTarget()]
    warm_up(tried, bodies=kind.bodies, rated=coding.bit_rate is not None, compact=coding.is_compact)
    raise_delayed()  # from here on, Ctrl-C ends the capture and not the command
    targets, stream = _targets(output, play=request.play)
    with _server(request, kind.description) as server:
        if server is not None:
            targets.append(StreamTarget(server.stage(0)))
        _capture(request, kind, outputs, targets, stream)


def _record(request: _Request, outputs: Outputs) -> None:
    """Record a stream that comes from a network."""
    from fba.cli.commands.live._streams import Recording, record

    source = network_source(Path(request.kind))
    seconds = None if request.seconds is None else float(request.seconds)
    targets, _ = _targets(request.output, play=False)
    raise_delayed()  # from here on, Ctrl-C ends the capture and not the command
    with _server(request, request.kind) as server, request.receiving.open(source) as receiver:
        if server is not None:
            targets.append(StreamTarget(server.stage(0)))
        recording = Recording(receiver, targets)
        record(recording, seconds, read_model(request.model) if request.play else None, play=request.play)
    recording.report(outputs, request.output, as_json=request.as_json)


def _server(request: _Request, title: str) -> AbstractContextManager[Server | None]:
    """Return the server of `--serve`, or nothing."""
    if request.serve is None:
        return nullcontext()
    return open_server([title], host=request.serve_host, port=request.serve)


def _capture(
    request: _Request, kind: Kind, outputs: Outputs, targets: list[Target], stream: StreamQueue | None
) -> None:
    """Capture to targets, one of which may be that of a window; print what was received."""
    from fba.live import Capture, Receiver

    network = request.network
    piped = request.output == STANDARD and request.coding.bit_rate is None  # to `fba send -`, for example
    recorder = request.coding.recorder(targets, served=piped or request.serve is not None)
    capture = Capture(
        kind, recorder.push, sender=network.sender, rate=request.rate, swap=request.swap,
        neutral=request.neutral, say=lambda text: click.echo(f"fba: {text}", err=True),
    )  # fmt: skip
    with Receiver(capture, host=network.host, port=network.port, ask=network.ask) as receiver:
        click.echo(f"fba: listening for {kind.description} on UDP port {receiver.port}", err=True)
        limit = None if request.seconds is None else float(request.seconds)
        try:
            if stream is None:
                with stopping(receiver.stop):
                    receiver.run(limit)
            else:
                _play(stream, receiver, capture, recorder, limit, request.model)
        finally:
            summary = capture.finish()
            recorder.finish()
    if not summary.frames:
        raise FbaError(_nothing(summary, capture, receiver))
    _report(outputs, request.output, recorder, summary, as_json=request.as_json)


def _check(request: _Request) -> None:
    """Raise click.UsageError for options that contradict each other."""
    coding = request.coding
    request.receiving.check((Path(request.kind),))
    for name in _OF_KINDS if request.kind not in KINDS else ():
        if options.is_given(name):
            flag = {"bit_rate": "--bitrate", "fap_quant": "--quant", "rate": "--fps"}.get(name, f"--{name}")
            raise click.UsageError(f"{flag} goes with {', '.join(KINDS)}: a stream is recorded as it comes")
    if request.output is None and not request.play and request.serve is None:
        raise click.UsageError("give -o OUT.fba to record, --play or --serve PORT to see it, or several")
    if request.serve_host is not None and request.serve is None:
        raise click.UsageError("--serve-host goes with --serve")
    if request.serve is not None and coding.bit_rate is not None:
        raise click.UsageError(
            "--serve and --bitrate contradict each other: viewers who come late need I planes, for which a "
            "bit rate leaves no room"
        )
    if request.model is not None and not request.play:
        raise click.UsageError("--model goes with --play")
    rate_options.check_buffer()
    if coding.bit_rate is not None and options.is_given("fap_quant"):
        raise click.UsageError("--quant and --bitrate contradict each other: the bit rate decides how finely")
    if coding.bit_rate is not None and coding.preset is not None:
        raise click.UsageError(
            "--preset and --bitrate contradict each other: the bit rate decides what is sent"
        )


class StreamQueue:
    """A target of a recorder whose bytes another thread reads: a `fba_player.playback.live.Readable`."""

    def __init__(self) -> None:
        self._parts: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._ended = False

    def begin(self, opening: bytes) -> None:
        """Begin the stream with the bytes before it."""
        self.write(opening, b"")

    def write(self, data: bytes, ending: bytes) -> None:
        """Add bytes."""
        if data:
            self._parts.put(data)

    def close(self) -> None:
        """End the stream."""
        self._parts.put(b"")

    def read1(self, _size: int = -1, /) -> bytes:
        """Return the next bytes, after waiting for them; b"" at the end."""
        part = b"" if self._ended else self._parts.get()
        self._ended = self._ended or not part
        return part


def _targets(output: Path | None, *, play: bool) -> tuple[list[Target], StreamQueue | None]:
    """Return the targets of the stream, and that of the window, or None."""
    from fba.live import StreamFile
    from fba.live.recording import StreamPipe

    targets: list[Target] = []
    if output is not None:
        targets.append(StreamPipe(sys.stdout.buffer) if output == STANDARD else StreamFile(output))
    stream = StreamQueue() if play else None
    return [*targets, *([] if stream is None else [stream])], stream


def _play(
    stream: StreamQueue, receiver: Receiver, capture: Capture, recorder: StreamRecorder, limit: float | None,
    model: Path | None,
) -> None:  # fmt: skip
    """Receive in a thread, and show the stream in a window until it is closed."""
    failures: list[Exception] = []

    def receive() -> None:
        try:
            receiver.run(limit)
        except Exception as error:  # raised again below, in the main thread
            failures.append(error)
        stream.close()

    thread = threading.Thread(target=receive, name="fba capture", daemon=True)
    thread.start()
    try:
        _show(stream, receiver, capture, recorder, model)
    except KeyboardInterrupt:
        click.echo("fba: stopped", err=True)
    except FbaError:
        if capture.summary.frames:
            raise
    finally:
        receiver.stop()
        thread.join()
    if failures:
        raise failures[0]


def _show(
    stream: StreamQueue, receiver: Receiver, capture: Capture, recorder: StreamRecorder, model: Path | None
) -> None:
    """Show a stream in a window until it is closed. Waits for its first frames, without a window.

    Raises BitstreamError if the stream ends before them.
    """
    from fba import player
    from fba.face import FaceModel
    from fba_player.playback.live import LiveAnimation, LiveTimeline, wait_for

    face = read_model(model) or FaceModel.default()
    live = LiveAnimation(stream, name=capture.kind.description, bap_steps=recorder.options.bap_steps)
    wait_for(live, lambda _text: click.echo("fba: waiting for the first face", err=True))

    def newest() -> tuple[FaceTrack | None, BodyTrack | None]:
        receiver.drain()
        return capture.newest()

    try:
        scene = player.Scene(live, face, timeline=LiveTimeline(live, face))  # type: ignore[arg-type]
        player.play(scene, title=capture.kind.description, newest=newest)
    finally:
        live.close()


def _nothing(summary: Summary, capture: Capture, receiver: Receiver) -> str:
    """Return the reason why there is nothing to write."""
    if not summary.received:
        return (
            f"no datagram came on UDP port {receiver.port}; check that {capture.kind.description} sends to "
            "an address of this computer and to this port, and that no firewall is between them"
        )
    return "no face came: " + "; ".join(summary.lines())


def _report(
    outputs: Outputs, output: Path | None, recorder: StreamRecorder, summary: Summary, *, as_json: bool
) -> None:  # fmt: skip
    """Print counts of received and written frames."""
    clamped = recorder.encoder.statistics.clamped_parameters
    kept = rate_options.rate_of(recorder.encoder)
    rate = recorder.rate
    seconds = Fraction(summary.frames) / rate
    if as_json:
        written = {"output": None if output is None else str(output), "size": recorder.size}
        outputs.print_json(
            {
                **written, "rate": str(rate), "kbit_per_second": _kbit(recorder, seconds), **summary.values(),
                **({} if kept is None else {"bitrate": rate_options.rate_values(kept)}),
            }
        )  # fmt: skip
        return
    for line in summary.lines():
        outputs.say(f"fba: {line}")
    if summary.other_senders:
        outputs.say("fba: --sender NAME chooses one of them")
    if output is not None:
        outputs.say(
            f"{display_name(output)}: {summary.frames} frames, {seconds_text(seconds)} at "
            f"{rate_text(rate)} frames/s, {recorder.size} bytes, {_kbit(recorder, seconds):.2f} kbit/s"
        )
    for line in (*(rate_options.rate_lines(kept) if kept is not None else ()), *clamped_lines(clamped)):
        outputs.say(line)


def _kbit(recorder: StreamRecorder, seconds: Fraction) -> float:
    return round(8 * recorder.size / float(seconds) / 1000, 3)
