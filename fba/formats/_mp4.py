"""MP4 files with an FBA stream (.mp4): recognised, read and written; `fba.carriage` knows their bytes."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Any

from fba.animation import Animation
from fba.atomic import atomic
from fba.choices import BapTableOrAuto
from fba.formats._fba import decode_file, encoder_settings
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, naming_file, read_whole

if TYPE_CHECKING:
    from fba.carriage.mp4 import SoundTrack
    from fba.codec import EncoderOptions


def sniff_mp4(head: bytes, suffix: str) -> bool:
    """Whether a file with this beginning is MP4 or QuickTime, whatever its tracks hold."""
    from fba.carriage.mp4 import is_mp4

    return is_mp4(head)


def read_stream(
    path: Path, *, track: int | None = None, salvage: bool = False, limits: Limits = DEFAULT_LIMITS
) -> bytes:
    """Return the bytes of the stream; see `fba.carriage.mp4.read_mp4`. Raises FormatError."""
    from fba.carriage import mp4

    with naming_file(path):
        return mp4.read_mp4(read_whole(path), track=track, path=path, salvage=salvage, limits=limits).stream


def read_mp4(
    path: Path,
    *,
    track: int | None = None,
    bap_steps: BapTableOrAuto | None = None,
    salvage: bool = False,
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Decode the FBA stream in an MP4 file.

    track: number of its track, where several hold FBA. salvage: also skip what a cut file lacks. Other
    options and errors: as for FBA files. Times are those of the stream; the file has the same.
    """
    data = read_stream(path, track=track, salvage=salvage, limits=limits)
    return decode_file(path, data, bap_steps, salvage=salvage, limits=limits)


def write_mp4(
    path: Path,
    animation: Animation,
    *,
    sound: SoundTrack | None = None,
    sound_offset: Fraction | float = 0,
    fragment: Fraction | float | None = None,
    options: EncoderOptions | None = None,
    **settings: Any,
) -> None:
    """Encode an animation into an MP4 file.

    sound, sound_offset, fragment: see `fba.carriage.mp4.write_mp4`. Others: as for FBA files.
    """
    from fba.carriage import mp4
    from fba.planning import encode

    with naming_file(path):
        stream = encode(animation, options, **settings)
        data = mp4.write_mp4(stream, sound=sound, sound_offset=sound_offset, fragment=fragment)
    with atomic(path) as file:
        file.write(data)


write_mp4.extra_options = encoder_settings  # type: ignore[attr-defined]
