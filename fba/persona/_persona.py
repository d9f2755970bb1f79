"""`Persona`: an actor's style of moving the face, as control masks of each part by class of expression."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fba.arrays import Float64, Intp
from fba.face import Fapu
from fba.persona._curves import Curves
from fba.persona.motion import Motion
from fba.persona.points.layout import flat_mask, part_vertices
from fba.persona.recognition._faps import measure_fapu

MEANS = ("motion", "curves", "masks")
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
