"""`Limits`: how much memory and time the content of a file may take."""

from __future__ import annotations

from dataclasses import dataclass, fields

from fba.errors import LimitError, Remedy

BYTES_PER_BYTE = 20
"""Bytes of memory that each byte of the input may take, in addition to `Limits.bytes`."""


@dataclass(frozen=True)
class Limits:
    """Limits of input, so that a damaged or hostile file cannot fill the memory or run for hours.

    The defaults exceed the needs of honest files; larger input is a LimitError, which names the limit.

    frames: of an animation, also after resampling.
    bytes: of memory for decoded content, in addition to 20 for each byte of the input.
    pixels: of a picture, width times height.
    seconds: from the first frame of an animation to the last, if every moment between them needs a frame.

    Raises ValueError for a limit that is not a positive integer.
    """

    frames: int = 6_000_000
    bytes: int = 100_000_000
    pixels: int = 1 << 26
    seconds: int = 7 * 24 * 3600

    def __post_init__(self) -> None:
        for limit in fields(self):
            value = getattr(self, limit.name)
            if not isinstance(value, int) or value < 1:
                raise ValueError(f"Limits: {limit.name} must be a positive integer, not {value!r}")

    def check_frames(self, count: int, what: str) -> None:
        """Raise LimitError if `what`, e.g. "the motion", has more frames than allowed."""
        if count > self.frames:
            raise _excess("frames", f"{what} has {count} frames", count, self.frames)

    def check_bytes(self, count: int, what: str, *, source: int = 0) -> None:
        """Raise LimitError if `what` takes more memory than allowed. source: bytes of the input."""
        allowed = self.bytes + BYTES_PER_BYTE * source
        if count > allowed:
            text = f"{what} takes {count} bytes of memory, made from {source} bytes of input"
            raise _excess("bytes", text, count, allowed, needed=count - BYTES_PER_BYTE * source)

    def check_pixels(self, width: int, height: int, what: str) -> None:
        """Raise LimitError if `what` has more pixels than allowed."""
        if width * height > self.pixels:
            text = f"{what} has {width} x {height} pixels"
            raise _excess("pixels", text, width * height, self.pixels)

    def check_seconds(self, seconds: float, what: str) -> None:
        """Raise LimitError if `what` lasts longer than allowed."""
        if seconds > self.seconds:
            raise _excess("seconds", f"{what} lasts {seconds:.0f} s", int(seconds), self.seconds)


DEFAULT_LIMITS = Limits()


def _excess(limit: str, finding: str, found: int, allowed: int, *, needed: int = 0) -> LimitError:
    """Return the error for an excess. needed: the value of the limit that would allow it; 0 for `found`."""
    return LimitError(
        f"{finding}, more than the {allowed} that the limit `{limit}` allows",
        limit=limit,
        found=found,
        allowed=allowed,
    ).with_remedies(
        Remedy(
            "limits",
            "if the file is to be trusted, raise it with {}",
            f"fba.Limits({limit}={_round_up(needed or found)})",
        )
    )


def _round_up(number: int) -> int:
    """Return a number rounded up to two significant digits."""
    unit = int(10 ** max(len(str(number)) - 2, 0))
    return -(-number // unit) * unit
