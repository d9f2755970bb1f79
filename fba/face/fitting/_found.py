"""What the finders of points return: the points, and pictures of the steps that led to them."""

from __future__ import annotations

from dataclasses import dataclass, field

from fba.arrays import UInt8


@dataclass(frozen=True, eq=False)
class Step:
    """A picture of one step: uint8 (H, W, 3), and what it shows."""

    title: str
    pixels: UInt8


@dataclass(frozen=True, eq=False)
class FoundPoints:
    """Points that were found on a photograph.

    points: pixels to the right and down by name. score: how well they look like those of a face, 0 to 1.
    steps: pictures of how they were found. doubts: by part of the face (eyes, brows, nose, mouth, chin), how
    far its points are apart when they are found from several places, in distances between the pupils.
    """

    points: dict[str, tuple[float, float]]
    score: float
    steps: list[Step] = field(default_factory=list)
    doubts: dict[str, float] = field(default_factory=dict)
