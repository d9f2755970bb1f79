"""Encode planes with given `PlaneSettings`, such as those of an EPF file, without any decisions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.animation import Animation
from fba.arrays import Int32, Intp
from fba.codec._plane import slots
from fba.codec._plane.writer import DoesNotFitError, PlaneWriter
from fba.codec.settings import PlaneSettings
from fba.errors import RangeError
from fba.parameters import BapTable


def encode_planes(
    animation: Animation, planes: Sequence[PlaneSettings], *, bap_steps: BapTable = "iso"
) -> bytes:
    """Return the stream of an animation, encoded plane by plane as `planes` say.

    `face_frame` and `body_frame` of a plane are the frame numbers that it codes, as in `animation.index`. Its
    masks override those of the animation: values that were not sent there are coded as 0.

    Raises RangeError if a value does not fit the ranges in force or a frame is missing, ValueError if the
    first plane is no I plane or a plane codes a part that has no settings yet.
    """
    if not planes:
        raise ValueError("encode_planes: no planes to encode")
    writer = PlaneWriter(bap_steps)
    writer.begin_object()
    rows = _rows(animation, planes)
    chunks = []
    position = 0
    while position < len(planes):
        settings = planes[position]
        try:
            if settings.intra:
                count = 1
                writer.intra(settings, rows[position])
            else:
                count = _run_length(planes, position)
                skips = np.array([p.skip for p in planes[position : position + count]], dtype=np.int64)
                for part in (slots.FACE_BIT, slots.BODY_BIT):
                    if _object_mask(settings) & part and writer.settings_in_force(part) is None:
                        raise ValueError(
                            f"encode_planes: plane {position} is a P plane before the first I plane"
                        )
                coding = rows[position : position + count]
                writer.predicted(_object_mask(settings), coding, skips, start_code=settings.start_code)
        except DoesNotFitError as error:
            plane = position + error.position
            value = int(rows[plane, error.slot])
            raise RangeError(
                f"plane {plane} codes the value {value} as level {error.level}, which the ranges in force "
                "do not hold; widen them (or let the encoder choose)",
                parameter=slots.label(error.slot),
                value=value,
                frame=settings.face_frame if settings.face_frame is not None else settings.body_frame,
            ) from None
        position += count
        chunks.append(writer.take_bytes())
    writer.end_object()
    chunks.append(writer.take_bytes())
    return b"".join(chunks)


def _rows(animation: Animation, planes: Sequence[PlaneSettings]) -> Int32:
    """Return the values of the planes, int32 (planes, columns), see `slots`."""
    rows = np.zeros((len(planes), slots.SLOTS), dtype=np.int32)
    if any(p.face is not None for p in planes):
        track = animation.face
        if track is None:
            raise RangeError("the planes to be coded carry FAPs, but the animation has no face track")
        coding, positions = _frames(animation, [p.face_frame if p.face is not None else None for p in planes])
        rows[coding, : slots.FLAGS.stop] = slots.track_rows(track, None)[positions]
    if any(p.body is not None for p in planes):
        if animation.body is None:
            raise RangeError("the planes to be coded carry BAPs, but the animation has no body track")
        coding, positions = _frames(animation, [p.body_frame if p.body is not None else None for p in planes])
        rows[coding, slots.BAPS] = animation.body.values[positions]
    return rows


def _frames(animation: Animation, numbers: Sequence[int | None]) -> tuple[Intp, Intp]:
    """Return the planes that code a frame, and the positions of these frames in the animation."""
    coding = np.array([i for i, number in enumerate(numbers) if number is not None], dtype=np.intp)
    wanted = np.array([number for number in numbers if number is not None], dtype=np.int64)
    positions = np.searchsorted(animation.index, wanted)
    exists = animation.index[np.minimum(positions, len(animation) - 1)] == wanted
    if not exists.all():
        gap = int(np.argmin(exists))
        raise RangeError(
            f"plane {coding[gap]} codes frame {wanted[gap]}, but the animation has no frame of that number "
            f"(it has {animation.index[0]}..{animation.index[-1]})",
            frame=int(wanted[gap]),
        )
    return coding, positions


def _object_mask(settings: PlaneSettings) -> int:
    """Return fba_object_mask."""
    face = slots.FACE_BIT if settings.face is not None else 0
    return face | (slots.BODY_BIT if settings.body is not None else 0)


def _run_length(planes: Sequence[PlaneSettings], position: int) -> int:
    """Return how many P planes from a position on carry the same parts, without a start code between them."""
    mask = _object_mask(planes[position])
    stop = position + 1
    while stop < len(planes) and not (planes[stop].intra or planes[stop].start_code):
        if _object_mask(planes[stop]) != mask:
            break
        stop += 1
    return stop - position
