"""`Persona`: an actor's style of moving the face, as control masks of each part by class of expression."""

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
from fba.persona._curves import RANKS, Curves
from fba.persona.motion import Motion
from fba.persona.points.layout import PARTS, TRACKED, flat_mask, part_vertices
from fba.persona.recognition import ClassRecogniser
from fba.persona.recognition._archive import Fields, pack_archive, read_archive
from fba.persona.recognition._faps import measure_fapu
from fba.source import Path

MEANS: tuple[Means, ...] = get_args(Means)
"""Conversions of a user's face, part by part: "curves" maps the user's expressions of each class to the
actor's; "motion" does the same and adds the actor's statistics of motion; "masks" shows the nearest mask of
the user's class."""
SHARE_OF_WIDTH = 0.05
"""l3 of the source: smallest distance between masks of a class, relative to the width of mouth or eye."""
WIDTHS = {
    "mouth": (42, 45), "left_eye": (19, 15), "right_eye": (21, 17), "left_brow": (19, 15),
    "right_brow": (21, 17),
}  # fmt: skip
"""Points between which that width is measured: the corners of the mouth or of the eye."""
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


@dataclass(frozen=True, eq=False)
class PartStyle:
    """An actor's style of a part of the face.

    labels: the class of each mask, such as "LFAU_12" or "LFAU_26/LFAU_12". moved: float64 (M, V, 3),
    displacements of the part's vertices from the actor's neutral mask, millimetres. source, frame: int (M,),
    the recording and the frame of each mask. curves: of each class. motion: statistics; None for files of
    version 1.
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
            name: np.array([n for n, label in enumerate(self.labels) if label == name])
            for name in sorted(set(self.labels))
        }

    def reach(self, scale: Float64) -> Float64:
        """Return the largest displacement of each coordinate in masks and curves: float64 (2V,).

        Millimetres on the standard face. scale: (2,), the actor's `face_scale`.
        """
        masks = np.abs(self.moved[..., :2] / scale).max(axis=0, initial=0.0)
        curves = np.abs(self.curves.moved).max(axis=(0, 1), initial=0.0)
        return np.asarray(np.maximum(np.concatenate([masks[:, 0], masks[:, 1]]), curves))

    def count(self) -> Counter[str]:
        """Return the number of masks of each class."""
        return Counter(self.labels)


@dataclass(frozen=True, eq=False)
class Persona:
    """An actor's style. Immutable.

    name: of the actor. neutral: float64 (64, 2), the actor's points at rest, on the standard mask,
    millimetres. parts: by the names of `PARTS`. frames: number in all recordings; kept: number used; turned:
    number left out because the head is turned by more than 30 degrees; untracked: number without a face.
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
        """Return a Persona from a file. recogniser: the one to use with it; None for the default.

        A file of version 1 has no statistics of motion. Raises FormatError for damage, or a Persona learnt
        with other classes; UnsupportedError for another version; LimitError.
        """
        known = ClassRecogniser.default() if recogniser is None else recogniser
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

    def save(self, path: Path, recogniser: ClassRecogniser | None = None) -> None:
        """Write the Persona, atomically: a `.persona` file, described in docs/persona.md.

        recogniser: the one it was learnt with; None for the default. A Persona without statistics of motion
        is written as version 1.
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
        """The actor's neutral mask (86, 3), with the depth and the outline of the standard mask."""
        return flat_mask(self.neutral)

    def mask(self, part: str, number: int) -> Float64:
        """Return one of the masks of a part, with the rest of the face neutral: float64 (86, 3)."""
        mask = self.neutral_mask.copy()
        mask[part_vertices(part)] += self.parts[part].moved[number]
        return mask

    @property
    def motions(self) -> dict[str, Motion] | None:
        """The statistics of each part's motion; None for files of version 1."""
        motions = {part: style.motion for part, style in self.parts.items() if style.motion is not None}
        return motions if len(motions) == len(self.parts) else None

    def missing(self, classes: dict[str, tuple[str, ...]]) -> dict[str, list[str]]:
        """Return the classes of each part that no mask shows, alone or as the first of two."""
        shown = {
            part: {label.partition("/")[0] for label in style.labels} for part, style in self.parts.items()
        }
        return {part: [name for name in classes[part] if name not in shown[part]] for part in self.parts}

    @property
    def size(self) -> int:
        """Size of all masks as float32, bytes."""
        return sum(4 * style.moved.size for style in self.parts.values())


def part_width(points: Float64, part: str) -> float:
    """Return the width of the mouth, or of the eye of a part, in neutral points (64, 2)."""
    first, second = WIDTHS[part]
    return float(np.linalg.norm(points[first - 1] - points[second - 1]))


def _read_part(fields: Fields, path: Path, part: str, known: ClassRecogniser, *, moves: bool) -> PartStyle:
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
