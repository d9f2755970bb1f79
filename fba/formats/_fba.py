"""FBA files (.fba): recognise, decode and encode them."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

from fba.animation import Animation
from fba.atomic import atomic
from fba.choices import BapTableOrAuto
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BAP_STEPS_AUTO
from fba.source import Path, naming_file, read_whole, stem_of

if TYPE_CHECKING:
    from fba.codec import EncoderOptions

START_CODES = (b"\0\0\1\xba", b"\0\0\1\x01")
"""fba_object_start_code, and that of old streams."""
_BEFORE = (b"\0\0\1\xb0", b"\0\0\1\xb5")
"""Visual object sequence and visual object: the layers of a stream that may stand before the object."""


def sniff_fba(head: bytes, suffix: str) -> bool:
    """Whether a file with this beginning is an FBA stream.

    MPEG program streams begin with the same start code, followed by a 0 bit. In an FBA object, the 1 bit of
    the first I plane follows, or the start code of a plane, with or without a byte of stuffing before it.
    """
    for code in START_CODES:
        if head.startswith(code):
            after = head[len(code) :]
            plane = after.removeprefix(b"\x7f").startswith(b"\0\0\1")
            return suffix == ".fba" or not after or after[0] >= 0x80 or plane
    return head.startswith(_BEFORE) and any(code in head for code in START_CODES)


def read_fba(
    path: Path,
    *,
    bap_steps: BapTableOrAuto | None = None,
    salvage: bool = False,
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Decode an FBA file.

    bap_steps: "iso" or "visage", the table of BAP steps with which it was encoded; None: the table that its
    mark names, "iso" without a mark; "auto": without a mark, the table with which it moves like a person (see
    `fba.formats.step_choice`). salvage: skip damage with an FbaWarning instead of raising. limits: see
    `fba.Limits`. An animation without a name is named after the file.

    Raises FormatError for the file, BitstreamError, UnsupportedError and LimitError for the stream.
    """
    return decode_file(path, read_stream(path), bap_steps, salvage=salvage, limits=limits)


def read_stream(path: Path, **_options: object) -> bytes:
    """Return the bytes of the stream, which are the file. Raises FormatError."""
    return read_whole(path)


def decode_file(
    path: Path, data: bytes, bap_steps: BapTableOrAuto | None, *, salvage: bool, limits: Limits
) -> Animation:
    """Return the animation of a stream that was read from a file; see `read_fba`."""
    from fba.codec import decode

    if bap_steps == BAP_STEPS_AUTO:
        from fba.formats.step_choice import choose_steps

        bap_steps = choose_steps(data, limits=limits).table
    with naming_file(path):
        animation = decode(
            data, bap_steps=bap_steps, on_error="salvage" if salvage else "raise", limits=limits
        )
    return replace(animation, name=animation.name or stem_of(path))


def write_fba(
    path: Path, animation: Animation, *, options: EncoderOptions | None = None, **settings: Any
) -> None:
    """Encode an animation into an FBA file.

    options: an EncoderOptions. settings: its fields as keywords instead, e.g. `fap_quant=2`, and the other
    arguments of `fba.encode`: `preset`, `tolerance` and `bit_rate`. Raises as `fba.encode` does, and
    FormatError if the file cannot be written.
    """
    from fba.planning import encode

    with naming_file(path):
        data = encode(animation, options, **settings)
    with atomic(path) as file:
        file.write(data)


def encoder_settings() -> tuple[str, ...]:
    """Return the names of the keywords of `write_fba`."""
    from fba.codec import EncoderOptions

    return (*(field.name for field in fields(EncoderOptions)), "tolerance", "bit_rate")


write_fba.extra_options = encoder_settings  # type: ignore[attr-defined]
