"""`fba speak`: a recording, a text or the timings of another program to a face that speaks."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from fba.cli import options
from fba.cli.command import Command, examples, option_errors
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import STANDARD, Output, Outputs, display_name, output_option
from fba.cli.printing import Progress, rate_text, seconds_text
from fba.errors import FormatError, warn

if TYPE_CHECKING:
    from fba.animation import Animation
    from fba.speech import Prosody, Speech

SHARE = options.FloatRange(0, 1)
MOST_TEXT_BYTES = 1 << 24
WELL_HEARD = 0.8
"""Nothing is said of missing words where at least this share of a text's words is heard."""
MOST_NAMED = 5
"""Spans that are named of those in which more is spoken than a text says."""
CURVE = b"jawopen"
"""A name that all curves of ARKit have, in small letters."""
CLIPPED = 0.001
"""A recording with at least this share of its samples at full scale counts as clipped."""


@dataclass(frozen=True, kw_only=True)
class _Said:
    """What is spoken."""

    audio: Path | None = option(
        type=options.EXISTING,
        metavar="FILE",
        help="Recording of the speech: anything that FFmpeg reads. -: what comes on standard input, a WAV or "
        "raw samples, is spoken while it comes, 0.3 s late.",
    )
    pcm: int | None = option(
        type=click.IntRange(1000, 200_000),
        metavar="HZ",
        help="With --audio -: samples a second of raw sound, signed 16 bits, lowest byte first, one channel. "
        "A WAV says its own.",
    )
    text: str | None = option(metavar="TEXT", help="What is spoken. Without --audio, a voice speaks it.")
    text_file: Path | None = option(type=options.FILE, metavar="FILE", help="The same from a file, in UTF-8.")
    timings: Path | None = option(
        type=options.FILE,
        metavar="FILE",
        help="Phones or visemes with their times, by another program: TextGrid, CTM, SRT with phones, files "
        "of Montreal Forced Aligner, Rhubarb, Papagayo, Moho; visemes of Azure, Oculus, Polly as JSON; "
        "ARKit's curves as CSV or JSON.",
    )
    language: str = option(
        default="en-us",
        show_default=True,
        metavar="NAME",
        help="Language of the text, as gruut names it: de-de, fr-fr.",
    )
    voice: Literal["flite", "espeak-ng", "espeak"] | None = option(
        default=None,
        help="Program of your machine that speaks the text; default: the first that is installed.",
    )

    def check(self) -> None:
        """Raise click.UsageError for too little or too much."""
        texts = [
            flag
            for flag, each in (("--text", self.text), ("--text-file", self.text_file))
            if each is not None
        ]
        if len(texts) == 2:
            raise click.UsageError("--text and --text-file both give the text; give one of them")
        if self.timings is not None and texts:
            raise click.UsageError(f"--timings says what is spoken when; leave {texts[0]} out")
        if self.timings is None and self.audio is None and not texts:
            raise click.UsageError("say what is spoken: give --audio, --text, --text-file or --timings")
        if self.voice is not None and (self.audio is not None or self.timings is not None):
            raise click.UsageError(
                "--voice speaks a text that has no recording; leave --audio and --timings out"
            )

        if self.pcm is not None and not self.is_live:
            raise click.UsageError("--pcm goes with --audio -: the samples that come on standard input")
        flag = texts[0] if texts else "--timings" if self.timings is not None else ""
        if self.is_live and flag:
            raise click.UsageError(
                f"--audio - is spoken while it comes, and {flag} needs all of it: give a file"
            )

    @property
    def is_live(self) -> bool:
        """Whether the sound comes on standard input."""
        return self.audio == STANDARD

    @property
    def needs_voice(self) -> bool:
        """Whether a program must speak the text."""
        return self.audio is None and self.timings is None


@dataclass(frozen=True, kw_only=True)
class _Manner:
    """How it is spoken and coded."""

    coding: Literal["faps", "visemes"] = option(
        default="faps",
        help="faps: low-level FAPs, each sound bent towards its neighbours, about 0.5 kbit/s. visemes: FAP "
        "1, about 0.2 kbit/s.",
    )
    every_sound: bool = option(
        default=False,
        help="Leave out no sound of a short sentence to keep that rate: up to 0.3 and 0.8 kbit/s.",
    )
    style: float = option(
        default=0.5, type=SHARE, show_default=True, help="From 0, mumbled, to 1, overarticulated."
    )
    life: float = option(
        default=0.5, type=SHARE, show_default=True,
        help="Nods, raised brows, blinks and glances that go with the speech; 0: the mouth alone.",
    )  # fmt: skip
    mood: str | None = option(
        metavar="NAME[=INTENSITY]", help="Speak in a mood: happy, sad=80; `fba express --list` lists all."
    )
    rate: Fraction = option(
        "--fps", type=options.RATE, default=Fraction(25), typed="25", metavar="RATE",
        help="Frame rate; only frames that the mouth needs are sent.",
    )  # fmt: skip


@click.command(
    cls=Command,
    epilog=examples(
        'fba speak --text "Good morning." -o morning.fba    # and morning.wav',
        'fba speak --audio talk.wav --text "What is said in it" -o talk.fba',
        "fba speak --audio talk.wav -o talk.fba    # without a text: rougher",
        "fba speak --timings cues.json --coding visemes -o talk.fba",
        "arecord -f S16_LE -r 16000 | fba speak --audio - -o talk.fba",
    ),
)
@with_options
def command(
    said: _Said,
    manner: _Manner = group(),
    output: Path = output_option("OUT.fba", "Stream to write; - for standard output.", required=True),
    no_clobber: bool = options.no_clobber_option,
    as_json: bool = options.json_option,
) -> None:
    """Let a face speak: find sounds in a recording, and write a stream in which the mouth makes them.

    A text that goes with the recording makes it better. A text alone is spoken by flite or eSpeak NG, if you
    have them; the sound is written beside the stream, where fba play finds it.
    """
    said.check()
    moods = _moods(manner)
    if said.is_live:
        _speak_live(said, manner, moods, output, no_clobber=no_clobber, as_json=as_json)
        return
    if said.needs_voice and output == STANDARD:
        raise click.UsageError("a voice writes its sound beside the stream; give the stream a name with -o")
    sound = output.with_suffix(".wav") if said.needs_voice else said.audio
    written = [Output("--output", output)]
    if said.needs_voice and sound is not None:
        written.append(Output("--output", sound))
    outputs = Outputs(written, [said.audio, said.text_file, said.timings], no_clobber=no_clobber)
    text = _text(said)
    from fba.planning import encode
    from fba.speech import encoder_options, enliven, perform

    motion = None if said.timings is None else _read_curves(said.timings, manner)
    spoken, prosody, voice = _find(said, text, sound, outputs, motion)
    if motion is not None and manner.coding == "faps":
        animation = enliven(motion, spoken, style=manner.style, life=manner.life, prosody=prosody)
    else:
        animation = perform(
            spoken,
            rate=manner.rate,
            coding=manner.coding,
            style=manner.style,
            life=manner.life,
            prosody=prosody,
            keep_goal=not manner.every_sound,
        )
    if moods:
        from fba.emotion import emote

        animation = emote(animation, moods)
    data = encode(animation, encoder_options(manner.coding))
    outputs.write(output, data)
    figures = _figures(spoken, animation, data)
    if as_json:
        outputs.print_json(figures)
        return
    text = _summary(output, spoken.seconds, len(animation), animation.rate, len(data))
    skipped = int(animation.index[-1]) + 1 - len(animation)
    if skipped:
        text += f"; {skipped} frames between them are skipped, over which players move evenly"
    if spoken.found is not None:
        text += f"; {spoken.found:.0%} of {len(spoken.words)} words heard"
    outputs.say(text)
    if voice:
        outputs.say(f"{sound}: spoken by {voice}")


def _speak_live(
    said: _Said, manner: _Manner, moods: list[Any], output: Path, *, no_clobber: bool, as_json: bool
) -> None:
    """Write a face that speaks what comes on standard input."""
    if manner.coding == "visemes":
        raise click.UsageError("--audio - sends low-level FAPs; leave --coding visemes out")
    outputs = Outputs([Output("--output", output)], [STANDARD], no_clobber=no_clobber)
    from fba.cli.recordings.voice import speak_live

    speech, recorder = speak_live(
        output, raw_rate=said.pcm, rate=manner.rate, style=manner.style, life=manner.life, moods=moods
    )
    if as_json:
        outputs.print_json(
            {
                "seconds": round(speech.seconds, 3),
                "frames": recorder.frames,
                "size": recorder.size,
                "bits_per_second": round(8 * recorder.size / speech.seconds, 1),
            }
        )
        return
    outputs.say(_summary(output, speech.seconds, recorder.frames, recorder.rate, recorder.size))


def _moods(manner: _Manner) -> list[Any]:
    if manner.mood is None:
        return []
    if manner.coding == "visemes":
        raise click.UsageError("--mood moves what visemes do not send; use it with --coding faps")
    name, _, intensity = manner.mood.partition("=")
    number = options.parse_number(intensity or "60")
    from fba.emotion import Mood

    with option_errors("--mood: "):
        return [Mood(name, number)]


def _text(said: _Said) -> str | None:
    if said.text_file is None:
        return said.text
    with said.text_file.open("rb") as file:
        data = file.read(MOST_TEXT_BYTES + 1)
    if len(data) > MOST_TEXT_BYTES:
        raise FormatError(f"has more than {MOST_TEXT_BYTES} bytes, too many for a text", path=said.text_file)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(
            f"is not UTF-8 text (byte {error.start}); save it as UTF-8", path=said.text_file
        ) from None


def _read_curves(path: Path, manner: _Manner) -> Animation | None:
    """Return the motion of a face that ARKit's curves hold; None for other timings."""
    from fba.source import read_head

    if CURVE not in read_head(path).lower():
        return None
    from fba.formats import read

    if manner.coding == "visemes":
        warn(
            f"{path}: visemes are guessed from the motion of its mouth, and most are not the ones that were "
            "meant; --coding faps sends the motion itself"
        )
    return read(path, rate=manner.rate)


def _find(
    said: _Said, text: str | None, sound: Path | None, outputs: Outputs, motion: Animation | None
) -> tuple[Speech, Prosody | None, str]:
    """Return what is spoken, its loudness and pitch, and the program that spoke it, if one did."""
    from fba.speech import find_timings, read_timings, split_text

    voice = ""
    words = None if text is None else split_text(text, said.language)
    if said.needs_voice:
        assert text is not None
        assert sound is not None
        voice = _speak(text, sound, said, outputs)
    if said.timings is not None:
        timings = read_timings(said.timings) if motion is None else find_timings(motion)
        return timings, None if sound is None else _measure(sound), voice
    assert sound is not None
    spoken, prosody = _listen(sound, words, said.language)
    return spoken, prosody, voice


def _speak(text: str, sound: Path, said: _Said, outputs: Outputs) -> str:
    from fba.speech import speak_text

    with tempfile.TemporaryDirectory(prefix="fba-") as folder:
        made = Path(folder) / "voice.wav"
        voice = speak_text(text, made, program=said.voice, language=said.language)
        outputs.write(sound, made.read_bytes())
    return voice


def _listen(sound: Path, words: Any, language: str) -> tuple[Speech, Prosody]:
    from fba.audio import find_duration, read_mono
    from fba.speech import RATE, Prosody, find_speech

    prosody = Prosody()
    seconds = find_duration(sound)
    total = None if seconds is None else ceil(seconds)
    try:
        with Progress("listening", total) as step:
            spoken = find_speech(
                prosody.watch(read_mono(sound, RATE)),
                words,
                language=language,
                progress=lambda end: step.show(round(end), total),
            )
    except FormatError as error:
        if str(sound) in str(error):
            raise
        raise FormatError(str(error), path=sound) from error
    _warn(sound, spoken, prosody)
    return spoken, prosody


def _measure(sound: Path) -> Prosody:
    from fba.audio import read_mono
    from fba.speech import RATE, Prosody

    prosody = Prosody()
    for _ in prosody.watch(read_mono(sound, RATE)):
        pass
    return prosody


def _warn(sound: Path, spoken: Speech, prosody: Prosody) -> None:
    from fba.speech import find_shapes

    if not any(shape.viseme for shape in find_shapes(spoken.phones)):
        warn(f"{sound}: no speech is heard in it; the face stays at rest")
    elif prosody.clipped > CLIPPED:
        warn(
            f"{sound}: {prosody.clipped:.1%} of its samples are clipped, and sounds are harder to tell apart"
        )
    if spoken.found is not None and spoken.found < WELL_HEARD:
        missed = ", ".join(f"{word.text!r} at {word.start:.1f} s" for word in spoken.missed)
        warn(f"{sound}: {spoken.found:.0%} of the text's words are heard; missing are {missed}")
    if spoken.extra:
        where = ", ".join(f"from {start:.1f} to {end:.1f} s" for start, end in spoken.extra[:MOST_NAMED])
        warn(f"{sound}: more is spoken than the text says, {where}; the mouth follows the sound there")


def _figures(spoken: Speech, animation: Animation, data: bytes) -> dict[str, Any]:
    return {
        "seconds": round(spoken.seconds, 3),
        "frames": len(animation),
        "size": len(data),
        "bits_per_second": round(8 * len(data) / spoken.seconds, 1),
        "words_heard": None if spoken.found is None else round(spoken.found, 3),
        "words": [
            {"text": word.text, "start": round(word.start, 3), "end": round(word.end, 3)}
            for word in spoken.words
        ],
        "phones": [
            {"name": phone.name, "start": round(phone.start, 3), "end": round(phone.end, 3)}
            for phone in spoken.phones
        ],
    }


def _summary(output: Path, seconds: float, frames: int, rate: Fraction, size: int) -> str:
    return (
        f"{display_name(output)}: {seconds_text(seconds)}, {frames} frames at {rate_text(rate)} frames/s, "
        f"{size} bytes, {8 * size / seconds / 1000:.2f} kbit/s"
    )
