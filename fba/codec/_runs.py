"""Runs of frames that send the same parameters, and their mask types."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Int32, Int64
from fba.codec._plane import slots, syntax
from fba.codec._plane.header_loops import MASK_ALL, MASK_INTERPOLATE, MASK_KEEP, MASK_NONE


@dataclass(frozen=True, eq=False)
class Run:
    """Consecutive frames that send the same parameters.

    rows: int32 (T, columns), see `slots`. index: int64 (T,). skips: int64 (T,), frames skipped after each.
    masks: bool (68,) or (296,) by part, True for sent parameters; parts without a track are missing.
    mask_types: by part, the mask type of every group.
    """

    rows: Int32
    index: Int64
    skips: Int64
    masks: dict[int, Bool]
    mask_types: dict[int, tuple[int, ...]]

    @property
    def parts(self) -> list[int]:
        """Parts that P planes of the run carry: those with sent parameters; the first without any."""
        return [part for part, types in self.mask_types.items() if any(types)] or [min(self.masks)]


def find_runs(frames: Animation, following: int, unsent: str) -> Iterator[Run]:
    """Yield the runs of frames, in order. following: index of the frame after them."""
    rows = slots.track_rows(frames.face, frames.body)
    skips = np.concatenate([frames.index[1:], [following]]) - frames.index - 1
    tracks = {
        part: track
        for part, track in ((slots.FACE_BIT, frames.face), (slots.BODY_BIT, frames.body))
        if track is not None
    }
    interpolated = frames.face.interpolated if frames.face is not None else None
    arrays = [track.mask for track in tracks.values()]
    if interpolated is not None:
        arrays.append(interpolated)
    for start, stop in pairwise([0, *_changes(arrays), len(frames)]):
        masks = {part: track.mask[start] for part, track in tracks.items()}
        wanted = {slots.FACE_BIT: interpolated[start]} if interpolated is not None else {}
        types = {part: mask_types(part, mask, wanted.get(part), unsent) for part, mask in masks.items()}
        yield Run(rows[start:stop], frames.index[start:stop], skips[start:stop], masks, types)


def _changes(arrays: list[Bool]) -> list[int]:
    """Return the rows at which any of the arrays (T, columns) differs from the row before."""
    if len(arrays[0]) == 1:
        return []
    changes = np.logical_or.reduce([(array[1:] != array[:-1]).any(axis=1) for array in arrays])
    rows: list[int] = (np.flatnonzero(changes) + 1).tolist()
    return rows


def mask_types(part: int, mask: Bool, interpolated: Bool | None, unsent: str) -> tuple[int, ...]:
    """Return the mask type of every group: none, all, or masked.

    mask: bool (68,) or (296,), sent parameters. interpolated: bool (68,), FAPs that the animation asks to be
    interpolated, or None. unsent: "keep" or "interpolate", for groups of which the animation does not ask for
    all unsent FAPs. Unsent BAPs always keep their values.
    """
    return _mask_types(
        part, mask.tobytes(), interpolated.tobytes() if interpolated is not None else b"", unsent
    )


@lru_cache(maxsize=64)
def _mask_types(part: int, mask: bytes, interpolated: bytes, unsent: str) -> tuple[int, ...]:
    """Return the same from bytes, which can be keys of the cache: a live encoder asks for every frame."""
    masked = MASK_INTERPOLATE if unsent == "interpolate" and part == slots.FACE_BIT else MASK_KEEP
    types = []
    for group in syntax.groups(part):
        sent = [mask[number - 1] for number in group]
        if all(sent):
            types.append(MASK_ALL)
        elif interpolated and all(mask[number - 1] or interpolated[number - 1] for number in group):
            types.append(MASK_INTERPOLATE)
        else:
            types.append(masked if any(sent) else MASK_NONE)
    return tuple(types)
