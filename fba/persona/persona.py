"""`Persona`: an actor's way of moving the face: control masks of each part, by the class that they show."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from typing import Any, get_args

import numpy as np

from fba.arrays import Array, Float64, Intp
from fba.atomic import atomic
from fba.choices import Means
from fba.errors import FormatError, ModelError
from fba.face import Fapu
from fba.limits import DEFAULT_LIMITS, Limits
from fba.persona.curves import RANKS, Curves
from fba.persona.motion import Motion
from fba.persona.points.layout import PARTS, TRACKED, flat_mask, part_vertices
from fba.persona.recognition import ClassRecogniser
from fba.persona.recognition.archive import Fields, pack_archive, read_archive
from fba.persona.recognition.faps import measure_fapu
from fba.source import Path

MEANS: tuple[Means, ...] = get_args(Means)
"""How a user's face becomes the actor's, part by part: by smooth maps that bring together how both show each
class and by the statistics of the actor's motion, by the maps alone, by the nearest mask of the user's
class."""
SHARE_OF_WIDTH = 0.05
"""l3: masks of a class that are nearer to each other than this share of the width of mouth or eye are one."""
WIDTHS = {
    "mouth": (42, 45), "left_eye": (19, 15), "right_eye": (21, 17), "left_brow": (19, 15),
    "right_brow": (21, 17),
}  # fmt: skip
"""Points between which that width is measured: corners of the mouth, and of the eye."""
KIND, VERSION, OLDEST = "persona", 2, 1
"""Version 1 has no statistics of motion."""
MOTION = ("seconds", "spread", "speed")
COUNTS = ("frames", "kept", "turned", "untracked")
LARGEST = 500.0
"""Millimetres: vertices of faces move less."""
MOST_FRAMES = 1 << 40
MOST_SECONDS = 1e9
MOST_LOG = 10.0
"""Natural logarithm: deviations in millimetres, and speeds for them per second, are within e^10 of 1."""


@dataclass(frozen=True, eq=False)
class PartStyle:
    """What an actor does with a part of the face.

    labels: the class of each mask, such as "LFAU_12" or "LFAU_26/LFAU_12". moved: float64 (M, V, 3),
    millimetres that the part's vertices have moved from the actor's neutral mask. source, frame: int (M,),
    the recording and its frame that a mask is from. curves: how the part shows each class. motion: how far,
    how fast and on which side it moves; None in Personas of files that are older than these statistics.
    """

    labels: tuple[str, ...]
    moved: Float64
    source: Intp
    frame: Intp
    curves: Curves
    motion: Motion | None = None

    @cached_property
    def rows(self) -> dict[str, Intp]:
        """Rows of the masks of each class."""
        return {
            name: np.array([n for n, one in enumerate(self.labels) if one == name])
            for name in sorted(set(self.labels))
        }

    def reach(self, scale: Float64) -> Float64:
        """Return how far each coordinate goes at most, in masks and curves: float64 (2V,), millimetres on
        the standard face. scale: (2,), the actor's `face_scale`."""
        masks = np.abs(self.moved[..., :2] / scale).max(axis=0, initial=0.0)
        curves = np.abs(self.curves.moved).max(axis=(0, 1), initial=0.0)
        return np.asarray(np.maximum(np.concatenate([masks[:, 0], masks[:, 1]]), curves))

    def count(self) -> Counter[str]:
        """Return how many masks each class has."""
        return Counter(self.labels)


@dataclass(frozen=True, eq=False)
class Persona:
    """An actor's style. Immutable.

    name: of the actor. neutral: float64 (64, 2), the actor's points at rest, on the standard mask,
    millimetres. parts: by the names of `PARTS`. frames: of all recordings; kept: those that masks were made
    of; turned: left out because the head is turned by more than 30 degrees; untracked: without a face.
    """

    name: str
    neutral: Float64
    parts: dict[str, PartStyle]
    frames: int
    kept: int
    turned: int
    untracked: int

    @staticmethod
    def load(
        path: Path, recogniser: ClassRecogniser | None = None, *, limits: Limits = DEFAULT_LIMITS
    ) -> Persona:
        """Return a Persona from a file. recogniser: what is used with it; None for the default.

        A file of version 1 gives one without statistics of motion. Raises FormatError for damage, or a
        Persona that was learnt with other classes; UnsupportedError for another version; LimitError.
        """
        known = ClassRecogniser.default() if recogniser is None else recogniser
        header, arrays = read_archive(path, KIND, VERSION, limits, oldest=OLDEST)
        fields = Fields(path, header, arrays)
        moves = header["version"] > OLDEST
        parts = {part: _read_part(fields, path, part, known, moves=moves) for part in PARTS}
        counts = [fields.number(name) for name in COUNTS]
        if any(count < 0 or count > MOST_FRAMES or count != int(count) for count in counts):
            raise FormatError(f"{', '.join(COUNTS)} must be whole numbers, not {counts}", path=path)
        neutral = fields.array("neutral", TRACKED, 2)
        persona = Persona(fields.text("name"), neutral, parts, *map(int, counts))
        try:
            persona.fapu  # noqa: B018 - raises ModelError for an impossible neutral face
        except ModelError as error:
            raise FormatError(error.finding, path=path) from error
        return persona

    def save(self, path: Path, recogniser: ClassRecogniser | None = None) -> None:
        """Write the Persona, atomically: a `.persona` file, described in docs/persona.md.

        recogniser: what it was learnt with; None for the default. A Persona that has no statistics of motion
        is written as version 1, in which they are not.
        """
        known = ClassRecogniser.default() if recogniser is None else recogniser
        header: dict[str, Any] = {"name": self.name, **{name: getattr(self, name) for name in COUNTS}}
        arrays: dict[str, Array] = {"neutral": self.neutral.astype(np.float32)}
        for part, style in self.parts.items():
            header[f"{part}.labels"] = list(style.labels)
            header[f"{part}.classes"] = list(known.components[part].classes)
            arrays |= {
                f"{part}.moved": style.moved.astype(np.float32),
                f"{part}.source": style.source.astype(np.int32),
                f"{part}.frame": style.frame.astype(np.int32),
                f"{part}.curves": style.curves.moved.astype(np.float32),
                f"{part}.known": style.curves.known.astype(np.uint8),
            }
            if self.motions is not None:
                motion = self.motions[part]
                arrays |= {f"{part}.{name}": getattr(motion, name).astype(np.float32) for name in MOTION}
        with atomic(path) as file:
            file.write(pack_archive(KIND, VERSION if self.motions else OLDEST, header, arrays))

    @cached_property
    def fapu(self) -> Fapu:
        """The actor's FAPU, millimetres on the standard mask."""
        return measure_fapu(self.neutral)

    @cached_property
    def neutral_mask(self) -> Float64:
        """The actor's neutral mask (86, 3): tracked points with the depth and the outline of the standard
        mask."""
        return flat_mask(self.neutral)

    def mask(self, part: str, number: int) -> Float64:
        """Return one of the masks of a part, with the rest of the face neutral: float64 (86, 3)."""
        mask = self.neutral_mask.copy()
        mask[part_vertices(part)] += self.parts[part].moved[number]
        return mask

    @property
    def motions(self) -> dict[str, Motion] | None:
        """How each part moves; None in Personas of files that are older than these statistics."""
        found = {part: style.motion for part, style in self.parts.items() if style.motion is not None}
        return found if len(found) == len(self.parts) else None

    def missing(self, classes: dict[str, tuple[str, ...]]) -> dict[str, list[str]]:
        """Return the classes of each part that no mask shows, alone or as the first of two."""
        return {
            part: [
                name
                for name in classes[part]
                if name not in {label.partition("/")[0] for label in style.labels}
            ]
            for part, style in self.parts.items()
        }

    @property
    def size(self) -> int:
        """Bytes of all masks as float32."""
        return sum(4 * style.moved.size for style in self.parts.values())


def part_width(points: Float64, part: str) -> float:
    """Return the width of the mouth, or of the eye of a part, in neutral points (64, 2)."""
    one, other = WIDTHS[part]
    return float(np.linalg.norm(points[one - 1] - points[other - 1]))


def _read_part(fields: Fields, path: Path, part: str, known: ClassRecogniser, *, moves: bool) -> PartStyle:
    """Return the style of a part. moves: whether there are statistics of motion. Raises FormatError."""
    classes = known.components[part].classes
    if fields.texts(f"{part}.classes") != classes:
        raise FormatError(
            f"{part}: it was learnt with other classes than are recognised here; learn it again", path=path
        )
    labels = fields.texts(f"{part}.labels")
    odd = [label for label in labels if not set(label.split("/")) <= set(classes)]
    if odd:
        raise FormatError(f"{part}: there is no class {odd[0]!r}"[:200], path=path)
    vertices = len(part_vertices(part))
    moved = fields.array(f"{part}.moved", len(labels), vertices, 3)
    curves = fields.array(f"{part}.curves", len(classes), len(RANKS), 2 * vertices)
    if max(float(np.abs(array).max(initial=0.0)) for array in (moved, curves)) > LARGEST:
        raise FormatError(f"{part}: vertices move by more than {LARGEST:g} mm", path=path)
    source, frame = (
        fields.indices(f"{part}.{name}", MOST_FRAMES, len(labels)) for name in ("source", "frame")
    )
    shown = fields.array(f"{part}.known", len(classes)) > 0
    motion = _read_motion(fields, path, part, len(classes) + 1, 2 * vertices) if moves else None
    return PartStyle(labels, moved, source, frame, Curves(curves, shown), motion)


def _read_motion(fields: Fields, path: Path, part: str, rows: int, width: int) -> Motion:
    """Return how a part moves. Raises FormatError."""
    seconds = fields.array(f"{part}.seconds", rows)
    spread, speed = fields.array(f"{part}.spread", rows, width), fields.array(f"{part}.speed", rows)
    if seconds.min() < 0 or seconds.max() > MOST_SECONDS:
        raise FormatError(f"{part}: seconds must be from 0 to {MOST_SECONDS:g}", path=path)
    if max(np.abs(spread).max(), np.abs(speed).max()) > MOST_LOG:
        raise FormatError(f"{part}: spread and speed must be from -{MOST_LOG:g} to {MOST_LOG:g}", path=path)
    return Motion(seconds, spread, speed)
