"""Speech on standard input, spoken by a face while it comes."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli.command import STANDARD_INPUT
from fba.cli.interruptions import raise_delayed, stopping
from fba.cli.live_streams import open_pipe
from fba.cli.outputs import STANDARD
from fba.cli.printing import Progress
from fba.cli.web_server import INTRA_PERIOD
from fba.encoder_options import EncoderOptions
from fba.errors import FormatError
from fba.source import naming_file

if TYPE_CHECKING:
    from fba.animation import Animation
    from fba.live import StreamRecorder
    from fba.speech import LiveSpeech


def speak_live(
    output: Path, *, raw_rate: int | None, rate: Fraction, style: float, life: float, moods: list[Any]
) -> tuple[LiveSpeech, StreamRecorder]:
    """Write a face that speaks what comes on standard input, until that ends, or on Ctrl-C.

    raw_rate: of samples without a header. Returns what was heard and written.
    """
    from fba.audio import read_pipe
    from fba.emotion import emote
    from fba.live.recording import StreamFile, StreamPipe, StreamRecorder, warm_up
    from fba.speech import RATE, LiveSpeech, encoder_options

    pipe = open_pipe("sound")
    speech = LiveSpeech(rate=rate, style=style, life=life)
    warm_up(compact=True)
    if not speech.recognises:
        click.echo(
            "fba: pocketsphinx is not installed: loudness and spectrum alone move jaw and lips", err=True
        )
    target = StreamPipe(sys.stdout.buffer) if output == STANDARD else StreamFile(output)
    coded = EncoderOptions(
        fap_quant=encoder_options("faps").fap_quant, clamp=True, start_codes=True, intra_period=INTRA_PERIOD
    )
    recorder = StreamRecorder([target], coded, compact=True)
    stopped: list[bool] = []

    def frames() -> Iterator[Animation]:
        for sound in read_pipe(pipe, RATE, raw_rate):
            yield from speech.push(sound)
            if stopped:
                break
        if not speech.seconds:
            raise FormatError("the sound is empty: it has no samples")
        yield from speech.finish()

    raise_delayed()  # from here on, Ctrl-C ends the sound and not the command
    try:
        with naming_file(STANDARD_INPUT), stopping(lambda: stopped.append(True)), Progress("listening", None):
            for frame in frames():
                recorder.push(emote(frame, moods) if moods else frame)
    finally:
        recorder.finish()
    return speech, recorder
