"""Poses from outlines: how far the bones of limbs are off, with and without a prior of time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.resources import files as package_files
from pathlib import Path

import numpy as np

import fba
from fba.animation import Animation
from fba.arrays import Bool, Float64, Int32
from fba.body import BapSolver, BodyModel
from fba.face import FaceModel
from fba.outlines import Choice, Figure, View, build_index, draw_silhouette
from fba.outlines._figure import read_poses

LIMBS = {
    f"{side}_{name}": (f"{side}_{start}", f"{side}_{end}")
    for side in "lr"
    for name, start, end in (
        ("upper arm", "shoulder", "elbow"), ("forearm", "elbow", "wrist"),
        ("thigh", "hip", "knee"), ("shank", "knee", "ankle"),
    )
}  # fmt: skip
"""Limbs: the joint that carries each, and the one at its end."""
VISIBLE = 0.25
"""Share of a limb's own silhouette that must be missing without it, for it to count as visible."""
QUERIES = 25
"""Pictures from each camera, at most."""
VIEWS = 24
CAMERAS = (View(7.0), View(37.0), View(97.0))
"""Sides of the pictures, each between those of the index."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A silhouette whose pose is known: directions (L, 3) of its limbs, and which are visible (L,).

    side: from where it is seen, degrees from where its hips face.
    """

    mask: Bool
    directions: Float64
    visible: Bool
    side: float


class Measure:
    """Directions of limbs, and pictures, of the built-in person."""

    def __init__(self) -> None:
        body = BodyModel.default()
        self._figure, self._solver = Figure(FaceModel.default(), body), BapSolver(body.skeleton)
        names = list(body.skeleton.names)
        self._ends = np.array([[names.index(joint) for joint in pair] for pair in LIMBS.values()])

    def directions(self, baps: Int32) -> Float64:
        """Return unit vectors (L, 3) along the limbs, in the frame of the whole figure's root."""
        matrices = self._solver.pose(baps)
        root = matrices[0, :3, :3]
        along = (matrices[self._ends[:, 1], :3, 3] - matrices[self._ends[:, 0], :3, 3]) @ root
        return np.asarray(along / np.linalg.norm(along, axis=1, keepdims=True))

    def heading(self, baps: Int32) -> float:
        """Return where the hips face, degrees to the figure's left from straight ahead."""
        forward = self._solver.pose(baps)[0, :3, 2]
        return float(np.degrees(np.arctan2(forward[0], forward[2])))

    def picture(self, faps: Int32, baps: Int32, view: View) -> Picture:
        """Return the picture of a pose from a side."""
        vertices, triangles = self._figure.vertices(faps, baps), self._figure.triangles
        carried = self._figure.joints[triangles[:, 0]]
        whole = draw_silhouette(vertices, triangles, view)
        visible = []
        for joint, _ in self._ends:
            of_limb = carried == joint
            limb = draw_silhouette(vertices, triangles[of_limb], view)
            rest = draw_silhouette(vertices, triangles[~of_limb], view)
            visible.append((limb & ~rest).sum() >= VISIBLE * limb.sum())
        return Picture(whole, self.directions(baps), np.array(visible), view.yaw - self.heading(baps))


def table(
    files: Sequence[Path], every: int, say: Callable[[str], None], other: Path | None = None
) -> list[str]:
    """Return the lines of a table. files: performances in the index. other: one to find, else their own
    frames between those of the index."""
    sample = package_files("fba") / "samples" / "hello.bvh"
    performances = {file.name: fba.read(file) for file in files or [Path(str(sample))]}
    say("drawing the index")
    index = build_index(performances.items(), Choice(views=VIEWS, every=every))
    asked: list[Animation] = list(performances.values()) if other is None else [fba.read(other)]
    measure = Measure()
    poses = [measure.directions(baps) for baps in index.stored.baps]
    headings = np.array([measure.heading(baps) for baps in index.stored.baps])
    results: dict[str, list[tuple[Float64, Bool, float]]] = {}
    for camera in CAMERAS:
        for animation in asked:
            say(f"{animation.name} from {camera.yaw:g} degrees")
            pictures = _pictures(animation, every if other is None else None, camera, measure)
            alone = [index.search(each.mask, 1)[0] for each in pictures]
            in_order = index.search_sequence([each.mask for each in pictures])
            for name, hits in (("nearest outline", alone), ("with time", in_order)):
                seen_from = [hit.view.yaw - headings[hit.number // VIEWS] for hit in hits]
                found = [poses[hit.number // VIEWS] for hit in hits]
                results.setdefault(name, []).extend(_errors(pictures, found, seen_from))
            results.setdefault("nearest pose (bound)", []).extend(_bound(poses, pictures))
            results.setdefault("random pose", []).extend(_chance(poses, pictures))
    lines = [
        "| chosen by | visible limbs, degrees | hidden limbs, degrees | side within 15 | side opposite |",
        "|---|---|---|---|---|",
    ]
    for name, rows in results.items():
        errors, seen = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
        turned = np.array([row[2] for row in rows])
        sides = (
            "- | -" if np.isnan(turned).all() else f"{np.mean(turned <= 15):.0%} | {np.mean(turned > 90):.0%}"
        )
        lines.append(f"| {name} | {errors[seen].mean():.1f} | {errors[~seen].mean():.1f} | {sides} |")
    rows = results["nearest outline"]
    share = np.mean([row[1] for row in rows])
    lines += ["", f"{len(rows)} pictures, {len(index)} silhouettes; {share:.0%} of the limbs are visible"]
    return lines


def _pictures(animation: Animation, every: int | None, camera: View, measure: Measure) -> list[Picture]:
    """Return pictures of the frames amid those of the index, or without a step, of frames spread evenly."""
    poses = read_poses(animation, FaceModel.default())
    frames = range(every // 2, len(animation), every) if every else range(0, len(animation), 1)
    frames = frames[:: max(len(frames) // QUERIES, 1)][:QUERIES]
    return [measure.picture(poses.faps[frame], poses.baps[frame], camera) for frame in frames]


def _off(found: Float64, true: Float64) -> Float64:
    """Return the angles (L,) between directions, degrees."""
    return np.asarray(np.degrees(np.arccos(np.clip((found * true).sum(axis=-1), -1, 1))))


def _errors(
    pictures: Sequence[Picture], found: Sequence[Float64], sides: Sequence[float]
) -> list[tuple[Float64, Bool, float]]:
    return [
        (_off(directions, each.directions), each.visible, abs((side - each.side + 180) % 360 - 180))
        for each, directions, side in zip(pictures, found, sides, strict=True)
    ]


def _bound(poses: Sequence[Float64], pictures: Sequence[Picture]) -> list[tuple[Float64, Bool, float]]:
    rows = []
    for each in pictures:
        errors = _off(np.array(poses), each.directions)
        rows.append((errors[errors.mean(axis=1).argmin()], each.visible, np.nan))
    return rows


def _chance(poses: Sequence[Float64], pictures: Sequence[Picture]) -> list[tuple[Float64, Bool, float]]:
    random = np.random.default_rng(1)
    return [
        (_off(poses[random.integers(len(poses))], each.directions), each.visible, np.nan) for each in pictures
    ]
