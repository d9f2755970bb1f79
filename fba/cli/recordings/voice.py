"""Voices: `--audio` of `fba encode` as a WAV file beside the stream, and speech spoken while it comes."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli import options
from fba.cli.command import STANDARD_INPUT
from fba.cli.interruptions import raise_delayed, stopping
from fba.cli.live_streams import INTRA_PERIOD, open_pipe
from fba.cli.option_fields import option
from fba.cli.outputs import STANDARD, Output, Outputs
from fba.cli.printing import Progress, clock_text, seconds_text
from fba.encoder_options import EncoderOptions
from fba.errors import FormatError
from fba.source import naming_file

if TYPE_CHECKING:
    from fba.cli.recordings.inputs import Inputs


@dataclass(frozen=True)
class Voice:
    """A sound beside a stream.

    source: the sound. target: the file beside the stream. begins: seconds from the stream's first frame to
    the begin of the sound. seconds: length of the stream. how: by which option or time codes, for messages.
    """

    source: Path
    target: Path
    begins: float
    seconds: Fraction
    how: str


@dataclass(frozen=True)
class VoiceOptions:
    """The sound beside the stream."""

    audio: Path | None = option(
        type=options.FILE,
        metavar="FILE",
        help="A sound that was recorded with the capture: the part that goes with the stream is written "
        "beside it, OUT.wav, where fba play and fba render find it.",
    )
    audio_offset: float | None = option(
        type=options.MOMENT,
        metavar="SECONDS",
        help="When the sound begins, after the first frame; default: by time codes where both have them, "
        "else 0.",
    )

    def check(self, output: Path) -> list[Output]:
        """Return the WAV file that will be written, if any; click.UsageError if it cannot be written."""
        if self.audio is None:
            if self.audio_offset is not None:
                raise click.UsageError("--audio-offset needs a sound: give one with --audio")
            return []
        if output == STANDARD:
            raise click.UsageError("--audio writes a sound beside the stream; give the stream a name with -o")
        target = output.with_suffix(".wav")
        if target.exists() and target.samefile(self.audio):
            raise click.UsageError(
                f"{self.audio} is beside {output} already: leave --audio out to play it from the first frame "
                "on, or give the stream another name"
            )
        return [Output("--audio", target)]


def place_voice(given: VoiceOptions, taken: Inputs, target: Path) -> Voice:
    """Return the given sound with its begin; FormatError for a file that is no sound, or of another time."""
    from fba.audio import SoundFile
    from fba.formats.time_codes import seconds_between
    from fba_player.sound.sound_clip import read_time_of_day

    assert given.audio is not None  # the target is its copy
    audio, offset = given.audio, given.audio_offset
    animation = taken.animation
    recorded, start = read_time_of_day(audio), taken.start
    first = None if start is None else start + float(animation.index[0] / animation.rate)
    begins, how = 0.0, "both from the start on"
    if offset is not None:
        begins, how = offset, "by --audio-offset"
    elif recorded is not None and first is not None:
        begins, how = seconds_between(first, recorded), "by time codes"
    with SoundFile(audio) as sound:
        length = sound.duration
    if begins >= animation.duration or (length is not None and begins + length <= 0):
        raise FormatError(
            f"shares no moment with the stream: it {_span(begins, length, first, how)}, and the stream "
            f"{_span(0.0, float(animation.duration), first, how)}; --audio-offset says when it begins",
            path=audio,
        )
    return Voice(audio, target, begins, animation.duration, how)


def write_voice(outputs: Outputs, voice: Voice) -> None:
    """Write the part of the sound that goes with the stream."""
    from fba.atomic import atomic
    from fba_player.sound.sound_clip import write_clip

    with outputs.file(voice.target) as name, atomic(name) as file:
        write_clip(file, voice.source, -Fraction(voice.begins), voice.seconds)


def voice_line(voice: Voice) -> str:
    """Return a line about the written sound."""
    silent = voice.begins > 0
    place = f"after {voice.begins:.2f} s of silence" if silent else f"from {abs(voice.begins):.2f} s on"
    return f"{voice.target}: {seconds_text(voice.seconds)} of {voice.source}, {place}, {voice.how}"


def voice_values(voice: Voice) -> dict[str, Any]:
    """Return values about the written sound, for programs."""
    return {"sound": {"file": str(voice.target), "begins": round(voice.begins, 6), "by": voice.how}}


def _span(begins: float, length: float | None, first: float | None, how: str) -> str:
    """Return begin and end as text, as times of day if `how` is by time codes. first: that of second 0."""
    shift = first if first is not None and how == "by time codes" else None
    texts = [
        seconds_text(moment) if shift is None else clock_text(shift + moment)
        for moment in (begins, *([] if length is None else [begins + length]))
    ]
    return "lasts from " + " to ".join(texts)


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
