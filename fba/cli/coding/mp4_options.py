"""MP4 files with a stream: `--fragment` and the sound beside it."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Literal

import click

from fba.cli import scenes
from fba.cli.coding.rate_options import amount_type
from fba.cli.option_fields import option
from fba.cli.options import is_given
from fba.limits import Limits
from fba.parameters import BapTable
from fba.source import naming_file

_DURATION = amount_type("length", {"": 1.0, "s": 1.0, "ms": 0.001}, "2s")


@dataclass(frozen=True, kw_only=True)
class Mp4Options:
    """How an MP4 file is written."""

    fragment: float | None = option(
        type=_DURATION,
        metavar="SECONDS",
        help="MP4: fragments of this length, for streaming, each from an I plane on where there is one.",
    )
    audio_codec: Literal["aac", "opus"] | None = option(
        help="MP4: how the sound is coded; default: AAC and Opus are copied, all else becomes AAC."
    )
    sound: scenes.SoundOptions

    def check(self, name: str) -> None:
        """Raise click.UsageError for options that do not fit a target in the format of this name."""
        scenes.check_sound_options(self.sound)
        for field in ("fragment", "audio_codec", "audio", "no_audio", "audio_offset"):
            if name != "mp4" and is_given(field):
                flag = f"--{field.replace('_', '-')}"
                raise click.UsageError(f"{flag} is for MP4 files, and OUT becomes {name.upper()}")

    def find_sound(self, source: Path) -> Path | None:
        """Return the sound that goes with a file, see `scenes.find_sound`."""
        return scenes.find_sound((source,), self.sound, "written without sound")

    def write(
        self, stream: bytes, source: Path, audio: Path | None, table: BapTable | None, limits: Limits
    ) -> tuple[bytes, str]:
        """Return an MP4 file with a stream and a sound, and words about the sound.

        source: the file of the stream. table: of BAP steps, of a stream that does not name it.
        """
        from fba.carriage.mp4 import write_mp4

        sound, about = None, ""
        if audio is not None:
            from fba_player.sound.coded_sound import read_coded_sound

            sound = read_coded_sound(audio, self.audio_codec)
            coding = {"aac": "AAC", "opus": "Opus"}[sound.coding]
            about = f", with the sound of {audio} as {coding}"
        offset = scenes.find_offset(audio, (source,), self.sound)
        with naming_file(source):
            data = write_mp4(
                stream,
                sound=sound,
                sound_offset=Fraction(offset).limit_denominator(1_000_000),
                fragment=None if self.fragment is None else Fraction(self.fragment).limit_denominator(1000),
                bap_steps=table,
                limits=limits,
            )
        return data, about
