"""Write FAP and BAP files: a header line, then a mask line and a value line per frame."""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import accumulate

import numpy as np

from fba.animation import Animation
from fba.arrays import Int32
from fba.atomic import atomic
from fba.errors import FormatError
from fba.formats.text._layout import Layout
from fba.formats.text._values import FRAME_NUMBER_MAX
from fba.formats.text.frame_rates import format_rate, parse_rate
from fba.source import Path
from fba.tracks import Track

BATCH_FRAMES = 2048
"""Frames that are formatted at once."""
_CACHED_MASKS = 64
"""Most masks whose text is cached: masks change seldom, or between a few."""


def write_frames(
    path: Path, layout: Layout, animation: Animation, track: Track, slots_of: Callable[[Track], Int32]
) -> None:
    """Write a file that `read_frames` reads back unchanged. slots_of: returns int32 (T, slots) for a track.

    The track is taken in batches, so that a compact track stays compact. Raises FormatError if the file
    cannot be written, or the format cannot hold the times.
    """
    index = animation.index
    if len(index) and max(-int(index[0]), int(index[-1])) > FRAME_NUMBER_MAX:
        raise FormatError(
            f"frame numbers {int(index[0])}..{int(index[-1])} do not fit this format "
            f"(at most {FRAME_NUMBER_MAX}); shift or resample the animation",
            path=path,
        )
    rate = format_rate(animation.rate)
    try:
        parse_rate(rate)
    except FormatError as error:
        raise FormatError(
            "the frame rate is a fraction with too many digits; resample the animation", path=path, token=rate
        ) from error
    name = _header_name(animation.name) or _header_name(os.path.basename(os.fspath(path))) or "animation"
    mask_texts: dict[bytes, bytes] = {}
    with atomic(path) as file:
        file.write(f"{layout.version} {name} {rate} {len(index)}\n".encode())
        for start in range(0, len(index), BATCH_FRAMES):
            part = slice(start, start + BATCH_FRAMES)
            batch = track[part]
            present = np.concatenate(
                [np.ones((len(batch), 1), dtype=bool), batch.mask[:, layout.parameter]], axis=1
            )
            table = np.concatenate([index[part, None], slots_of(batch)], axis=1)
            texts = list(map(str, table[present].tolist()))
            ends = list(accumulate(present.sum(axis=1).tolist(), initial=0))
            lines: list[bytes] = []
            for row, bits in enumerate(batch.mask):
                key = bits.tobytes()
                if key not in mask_texts:
                    if len(mask_texts) >= _CACHED_MASKS:
                        mask_texts.clear()
                    mask_texts[key] = " ".join(map(str, bits.astype(np.int8).tolist())).encode()
                lines.append(mask_texts[key])
                lines.append(" ".join(texts[ends[row] : ends[row + 1]]).encode())
            lines.append(b"")
            file.write(b"\n".join(lines))


def _header_name(name: str) -> str:
    """Return a name that fits a header line: no line breaks or control characters, single blanks."""
    clean = "".join(c if c.isprintable() else " " for c in name)
    return " ".join(clean.split()).encode("utf-8", "replace").decode()
