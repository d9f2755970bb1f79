"""How well does a simplified face keep its shape, its outline and its motion, beside other simplifiers?

`python -m bench.figures.simplification [STREAM...]` prints the tables of docs/simplify.md. Others: the
quadrics of this project, and those of fast-simplification and pyfqmr where these are installed (pip install
fast-simplification pyfqmr); they know the face at rest only. Their vertices move like the mean of those that
each stands for, or like the nearest one.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw
from scipy.spatial import cKDTree

import fba
from fba.arrays import Bool, Float64, Int32
from fba.face import Deformer, FaceModel, resolve
from fba.face.gltf.morphs import morph_values
from fba.face.simplification import simplify_face
from fba.mesh.simplify import simplify_by_quadrics
from fba.mesh.simplify._memoryless import _nearest

SHARES = (0.9, 0.61, 0.32, 0.1)
"""Shares of the triangles that are kept; the first three are those of the source."""
CANDIDATES = 48
"""Triangles with the nearest centres among which the nearest one of a point is sought."""
PIXELS = 256
"""Width of a silhouette."""
FRAME_STEP = 50
LIPS = (*range(4, 14), *range(51, 61))
LIDS = (19, 20, 21, 22)
TOLERANCES = tuple(2e-5 * 1.25**step for step in range(32))


@dataclass(frozen=True)
class Reduced:
    """A reduced face at rest, and a function from displacements of the full face to those of its vertices."""

    vertices: Float64
    triangles: Int32
    carry: Callable[[Float64], Float64]


Method = Callable[[FaceModel, int], Reduced]


def ours(model: FaceModel, faces: int) -> Reduced:
    """Memoryless collapses over poses; the tables are fitted anew, so FAPs move the result, not `carry`."""
    made = simplify_face(model, faces)
    level = made.build(made.mesh.level(faces))
    return Moved(level.model)


class Moved(Reduced):
    """A face that its own tables move."""

    def __init__(self, model: FaceModel) -> None:
        super().__init__(model.vertices.astype(np.float64), model.triangles, lambda shifts: shifts)
        object.__setattr__(self, "model", model)


def own_quadrics(model: FaceModel, faces: int) -> Reduced:
    """The quadrics of this project, at rest; vertices that are left are vertices of the full face."""
    full = model.vertices.astype(np.float64)
    onto, first = simplify_by_quadrics(full, 1, model.triangles, TOLERANCES)
    target = np.arange(len(full))
    for level in range(len(TOLERANCES)):
        collapses = first <= level
        target = np.arange(len(full))
        while collapses[target].any():
            target = np.where(collapses[target], onto[target], target)
        a, b, c = target[model.triangles].T
        left = target[model.triangles][(a != b) & (b != c) & (c != a)]
        if len(left) <= faces:
            break
    rows, corners = np.unique(left, return_inverse=True)
    return Reduced(full[rows], corners.reshape(-1, 3).astype(np.int32), lambda shifts: shifts[rows])


def fast_simplification(model: FaceModel, faces: int) -> Reduced:
    """The package of this name."""
    import fast_simplification as package

    points, corners = model.vertices.copy(), model.triangles.copy()
    *_, collapses = package.simplify(points, corners, 1 - faces / len(corners), return_collapses=True)
    reduced, triangles, cluster = package.replay_simplification(points, corners, collapses)
    count = np.maximum(np.bincount(cluster, minlength=len(reduced)), 1)

    def carry(shifts: Float64) -> Float64:
        sums = [np.bincount(cluster, axis, minlength=len(reduced)) / count for axis in shifts.T]
        return np.stack(sums, axis=1)

    return Reduced(reduced.astype(np.float64), triangles, carry)


def pyfqmr(model: FaceModel, faces: int) -> Reduced:
    """The package of this name."""
    from pyfqmr import Simplify

    simplifier = Simplify()
    simplifier.setMesh(model.vertices.copy(), model.triangles.copy())
    simplifier.simplify_mesh(target_count=faces, aggressiveness=7, preserve_border=False, verbose=False)
    vertices, triangles, _ = simplifier.getMesh()
    nearest = cKDTree(model.vertices).query(vertices)[1]
    return Reduced(vertices, triangles.astype(np.int32), lambda shifts: shifts[nearest])


METHODS: tuple[Method, ...] = (ours, own_quadrics, fast_simplification, pyfqmr)


def place(points: Float64, vertices: Float64, triangles: Int32) -> tuple[Int32, Float64]:
    """Return corners (N, 3) and weights (N, 3) of the nearest point of a surface to each of points (N, 3)."""
    near = cKDTree(vertices[triangles].mean(axis=1)).query(points, k=min(CANDIDATES, len(triangles)))[1]
    listed, own = near.ravel(), np.repeat(np.arange(len(points)), near.shape[1])
    owners = np.repeat(own[:, None], 3, axis=1).astype(np.int32)
    return _nearest(points, vertices[triangles[listed]], owners, np.arange(len(points)), triangles[listed])


def distances(points: Float64, placed: tuple[Int32, Float64], vertices: Float64) -> Float64:
    """Return (N,), mm: how far points (N, 3) are from where they are placed on a surface."""
    rows, weights = placed
    on = np.einsum("nk,nkd->nd", weights, vertices[rows])
    return np.asarray(1000 * np.linalg.norm(on - points, axis=1))


def views() -> Iterator[tuple[Float64, Float64]]:
    """Yield the axes to the right and up of 26 views: from the faces, edges and corners of a cube."""
    for direction in product((-1, 0, 1), repeat=3):
        if not any(direction):
            continue
        towards = np.array(direction, dtype=np.float64)
        towards /= np.linalg.norm(towards)
        side = np.cross((0.0, 1.0, 0.0) if abs(towards[1]) < 0.99 else (0.0, 0.0, 1.0), towards)
        side /= np.linalg.norm(side)
        yield side, np.cross(towards, side)


def silhouettes(vertices: Float64, triangles: Int32, middle: Float64, size: float) -> list[Bool]:
    """Return the silhouettes (PIXELS, PIXELS) of a mesh in all views."""
    pictures = []
    for right, up in views():
        flat = ((vertices - middle) @ np.stack([right, up], axis=1) / size + 0.5) * PIXELS
        picture = Image.new("1", (PIXELS, PIXELS))
        draw = ImageDraw.Draw(picture)
        for corners in flat[triangles].reshape(-1, 6).tolist():
            draw.polygon(corners, fill=1)
        pictures.append(np.array(picture))
    return pictures


def picture_frame(full: Float64) -> tuple[Float64, float]:
    """Return the middle of the vertices (V, 3) and the size of pictures that show all of them."""
    return (full.min(axis=0) + full.max(axis=0)) / 2, 1.1 * float(np.linalg.norm(np.ptp(full, axis=0)))


@cache
def silhouettes_of(model: FaceModel) -> list[Bool]:
    """Return the silhouettes of the full face."""
    full = model.vertices.astype(np.float64)
    return silhouettes(full, model.triangles, *picture_frame(full))


def motions(model: FaceModel, streams: Sequence[Path]) -> dict[str, Float64]:
    """Return FAPs (T, 68): each FAP by itself as far as its morph target goes, and some frames of streams."""
    single = np.zeros((66, 68))
    for row, (fap, value) in enumerate(sorted(morph_values().items())):
        single[row, fap - 1] = value
    found = {"all FAPs": single}
    for path in streams:
        face = fba.read(path).face
        if face is None:
            raise SystemExit(f"{path}: there is no face in it")
        found[path.stem] = resolve(face, model.fit)[::FRAME_STEP]
    for values in found.values():
        values[:, 47:50] = 0  # the head turns all methods alike
    return found


def region(model: FaceModel, numbers: Sequence[int]) -> Bool:
    """Return (V,): the skin that one of these FAPs moves at least half as far as what it moves most."""
    chosen = np.zeros(len(model.vertices), dtype=bool)
    skins = [part.name for part in model.of_kind("skin")]
    for fap in numbers:
        for mesh in model.table_of[fap].meshes:
            size = np.linalg.norm(mesh.displacements, axis=2).max(axis=1)
            if mesh.part in skins:
                chosen[mesh.vertices[size > 0.5 * size.max()] + model.starts[mesh.part]] = True
    return chosen


def measure(model: FaceModel, method: Method, faces: int, moved: dict[str, Float64]) -> list[str]:
    """Return the row of a method: triangles, time, distances (mm), silhouettes (%), moved distances."""
    start = time.process_time()
    reduced = method(model, faces)
    spent = time.process_time() - start
    full = model.vertices.astype(np.float64)
    rest, triangles = reduced.vertices, reduced.triangles
    placed = place(full, rest, triangles)
    there = distances(full, placed, rest)
    samples = np.concatenate([rest, rest[triangles].mean(axis=1)])
    back = distances(samples, place(samples, full, model.triangles), full)
    before, after = silhouettes_of(model), silhouettes(rest, triangles, *picture_frame(full))
    off = sum(int((a != b).sum()) for a, b in zip(before, after, strict=True))
    row = [
        f"{len(triangles)}", f"{spent:.1f}", f"{there.mean():.2f} / {np.percentile(there, 99):.2f}",
        f"{back.mean():.2f} / {np.percentile(back, 99):.2f}",
        f"{100 * off / sum(int(a.sum()) for a in before):.2f}",
    ]  # fmt: skip
    mover, small = Deformer(model), getattr(reduced, "model", None)
    own_mover = None if small is None else Deformer(small)
    lips, lids = region(model, LIPS), region(model, LIDS)
    for values in moved.values():
        errors = []
        for frame in values:
            pose = mover.local(frame).astype(np.float64)
            here = rest + reduced.carry(pose - full) if own_mover is None else own_mover.local(frame)
            errors.append(distances(pose, placed, np.asarray(here, dtype=np.float64)))
        every = np.array(errors)
        row += [f"{every.mean():.2f} / {np.percentile(every, 99):.2f}"]
        row += [f"{np.percentile(every[:, lips], 99):.2f}, {np.percentile(every[:, lids], 99):.2f}"]
    return row


def main(arguments: Sequence[str]) -> None:
    """Print a table for each share."""
    model = replace(FaceModel.default(), levels=())
    moved = motions(model, [Path(name) for name in arguments])
    head = ["method", "triangles", "s", "full to reduced, mm", "reduced to full, mm", "silhouettes, %"]
    for name in moved:
        head += [f"{name}, mm", "its lips, lids"]
    print("Distances are means / 99 %; of lips and lids 99 %.\n")
    for share in SHARES:
        print(f"{100 * share:.0f} % of {len(model.triangles)} triangles\n\n| {' | '.join(head)} |")
        print("|" + "---|" * len(head))
        for method in METHODS:
            try:
                row = measure(model, method, round(share * len(model.triangles)), moved)
            except ImportError as error:
                print(f"| {method.__name__} | not installed: {error.name} |")
                continue
            print(f"| {method.__name__.replace('_', '-')} | {' | '.join(row)} |", flush=True)
        print()


if __name__ == "__main__":
    main(sys.argv[1:])
