"""Personas in `.persona` files, described in docs/persona.md."""

from __future__ import annotations

from typing import Any

import numpy as np

from fba.arrays import Array
from fba.atomic import atomic
from fba.errors import FormatError, ModelError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.persona._curves import RANKS, Curves
from fba.persona._persona import PartStyle, Persona
from fba.persona.motion import Motion
from fba.persona.points.layout import PARTS, TRACKED, part_vertices
from fba.persona.recognition import Recogniser
from fba.persona.recognition._archive import Fields, pack_archive, read_archive
from fba.source import Path

KIND = "persona"
VERSION = 2
OLDEST = 1
"""Oldest version that is read; it has no statistics of motion."""
MOTION = ("seconds", "spread", "speed")
COUNTS = ("frames", "kept", "turned", "untracked")
MAX_DISPLACEMENT = 500.0
"""Largest displacement of a vertex, millimetres."""
MAX_FRAMES = 1 << 40
MAX_SECONDS = 1e9
MAX_LOG = 10.0
"""Largest magnitude of a logarithm in the statistics of motion."""


def save_persona(persona: Persona, path: Path, recogniser: Recogniser | None = None) -> None:
    """Write a Persona, atomically. recogniser: the one it was learnt with; None for the default.

    A Persona without statistics of motion is written as version 1.
    """
    known = Recogniser.default() if recogniser is None else recogniser
    header: dict[str, Any] = {"name": persona.name, **{name: getattr(persona, name) for name in COUNTS}}
    arrays: dict[str, Array] = {"neutral": persona.neutral.astype(np.float32)}
    for part, style in persona.parts.items():
        header[f"{part}.labels"] = list(style.labels)
        header[f"{part}.classes"] = list(known.components[part].classes)
        arrays |= {
            f"{part}.moved": style.moved.astype(np.float32),
            f"{part}.source": style.source.astype(np.int32),
            f"{part}.frame": style.frame.astype(np.int32),
            f"{part}.curves": style.curves.moved.astype(np.float32),
            f"{part}.known": style.curves.known.astype(np.uint8),
        }
        if persona.motions is not None:
            motion = persona.motions[part]
            arrays |= {f"{part}.{name}": getattr(motion, name).astype(np.float32) for name in MOTION}
    with atomic(path) as file:
        file.write(pack_archive(KIND, VERSION if persona.motions else OLDEST, header, arrays))


def load_persona(
    path: Path, recogniser: Recogniser | None = None, *, limits: Limits = DEFAULT_LIMITS
) -> Persona:
    """Return a Persona from a file. recogniser: the one to use with it; None for the default.

    A file of version 1 has no statistics of motion. Raises FormatError for damage, or a Persona learnt with
    other classes; UnsupportedError for another version; LimitError.
    """
    known = Recogniser.default() if recogniser is None else recogniser
    header, arrays = read_archive(path, KIND, VERSION, limits, oldest=OLDEST)
    fields = Fields(path, header, arrays)
    moves = header["version"] > OLDEST
    parts = {part: _read_part(fields, path, part, known, moves=moves) for part in PARTS}
    counts = [fields.number(name) for name in COUNTS]
    if any(count < 0 or count > MAX_FRAMES or count != int(count) for count in counts):
        raise FormatError(f"{', '.join(COUNTS)} must be whole numbers, not {counts}", path=path)
    neutral = fields.array("neutral", TRACKED, 2)
    persona = Persona(fields.text("name"), neutral, parts, *map(int, counts))
    try:
        persona.fapu  # noqa: B018 - raises ModelError for an impossible neutral face
    except ModelError as error:
        raise FormatError(error.finding, path=path) from error
    return persona


def _read_part(fields: Fields, path: Path, part: str, known: Recogniser, *, moves: bool) -> PartStyle:
    """Return the style of a part. moves: whether there are statistics of motion. Raises FormatError."""
    classes = known.components[part].classes
    if fields.texts(f"{part}.classes") != classes:
        raise FormatError(
            f"{part}: it was learnt with other classes than the recogniser has; learn it again", path=path
        )
    labels = fields.texts(f"{part}.labels")
    unknown = [label for label in labels if not set(label.split("/")) <= set(classes)]
    if unknown:
        raise FormatError(f"{part}: there is no class {unknown[0]!r}"[:200], path=path)
    vertices = len(part_vertices(part))
    moved = fields.array(f"{part}.moved", len(labels), vertices, 3)
    curves = fields.array(f"{part}.curves", len(classes), len(RANKS), 2 * vertices)
    if max(float(np.abs(array).max(initial=0.0)) for array in (moved, curves)) > MAX_DISPLACEMENT:
        raise FormatError(f"{part}: vertices move by more than {MAX_DISPLACEMENT:g} mm", path=path)
    source, frame = (
        fields.indices(f"{part}.{name}", MAX_FRAMES, len(labels)) for name in ("source", "frame")
    )
    shown = fields.array(f"{part}.known", len(classes)) > 0
    motion = _read_motion(fields, path, part, len(classes) + 1, 2 * vertices) if moves else None
    return PartStyle(labels, moved, source, frame, Curves(curves, shown), motion)


def _read_motion(fields: Fields, path: Path, part: str, rows: int, width: int) -> Motion:
    """Return the statistics of a part's motion. Raises FormatError."""
    seconds = fields.array(f"{part}.seconds", rows)
    spread, speed = fields.array(f"{part}.spread", rows, width), fields.array(f"{part}.speed", rows)
    if seconds.min() < 0 or seconds.max() > MAX_SECONDS:
        raise FormatError(f"{part}: seconds must be from 0 to {MAX_SECONDS:g}", path=path)
    if max(np.abs(spread).max(), np.abs(speed).max()) > MAX_LOG:
        raise FormatError(f"{part}: spread and speed must be from -{MAX_LOG:g} to {MAX_LOG:g}", path=path)
    return Motion(seconds, spread, speed)
