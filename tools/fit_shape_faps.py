"""Fits the FAPs of ARKit's 52 shapes: `python tools/fit_shape_faps.py HEAD.glb... [--write]`.

A head that has the shapes is imported without them: `fba.face.authoring` moves its vertices by FAPs as the
geometry alone says. What each shape does to the skin is then solved for FAPs by least squares within their
ranges: sum of (FAP x the displacement by one step of it) = displacement by the shape. Left and right shapes
count together, mirrored; of several heads, the median is taken. Eyeballs are not solved for: see `MEASURED`.

Prints, for every shape, the FAPs in `shape_faps.csv`, those fitted to each head, their median, and which
part of the shape's motion the FAPs reproduce. --write replaces the rows of ARKit's shapes, except those in
`KEPT`. Heads are not part of the project: docs/capture-faces.md says which were used.
"""

from __future__ import annotations

import argparse
import csv
import re
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import lsq_linear

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from fba.capture import shape_faps  # noqa: E402
from fba.errors import FbaError  # noqa: E402
from fba.face import Deformer  # noqa: E402
from fba.face.importers._gltf import gltf_pieces, locate  # noqa: E402
from fba.face.importers.assembly._pieces import assemble, shift_piece  # noqa: E402
from fba.face.importers.assembly.model import ImportOptions, finish_import, metres_per_unit  # noqa: E402
from fba.face.shape_names import arkit_names, canonical_names  # noqa: E402
from fba.parameters import FAP_COUNT, fap_numbers, faps, point_rows  # noqa: E402

TABLE = ROOT / "fba/capture/blendshapes/shape_faps.csv"
SOLVED = {
    "brow": [*range(31, 39)],
    "eye": [19, 20, 21, 22, 41, 42],
    "cheek": [6, 7, 12, 13, 21, 22, 39, 40, 41, 42],
    "jaw": [*range(3, 19)],
    "mouth": [*range(4, 14), 16, 17, 18, *range(39, 43), 61, 62],
    "nose": [4, 8, 9, 31, 32, 37, 38, 41, 42, 61, 62, 63],
}
"""FAPs that shapes are solved for, by the first word of their names: those near the muscles in them."""
MEASURED = {
    "yaw": 57_500,
    "pitch": 61_000,
}
"""Eyeballs at weight 1: recordings of Live Link Face have shapes and angles, 0.58 and 0.61 rad."""
KEPT = ("tongueOut",)
"""Shapes whose vertices are inside the mouth, where heads differ too much."""
ROUNDS = {"jaw": 3, "eye": 3}
"""Times that paths which are not straight are followed anew from the values found: jaws and lids turn."""
BACK = -60
"""How far lips go back at most, unless they roll in or hang from the jaw: other heads have teeth there."""
CORRECTED = {
    "jawOpen": {"depress_chin": 0, "push_b_lip": -300, "raise_l_cornerlip": -400, "raise_r_cornerlip": -400},
    "mouthClose": {"depress_chin": 0, "push_b_lip": 300},
    "cheekPuff": {"puff_l_cheek": 300, "puff_r_cheek": 300},
}
"""What pictures of other heads showed to be wrong: a pointed chin and a lip behind the teeth where the jaw
opens, and cheeks that did not seem to puff, as their feature points are at the side."""
LIPS = ((4, 5), (8, 10), (9, 11))
"""FAPs of the upper and of the lower lip at one place, which add up to 0 where the lips touch."""
LOWEST = 330
"""How far an upper lip comes down to meet that of an open jaw: as far as skin goes on every head."""
LIDS = ((19, 21), (20, 22))
CLOSED = 1024
"""Sum of the FAPs of two lids that touch."""
POINTS = 1.0
"""Weight of all feature points, by whose motion the standard defines FAPs, relative to that of all skin."""
RIDGE = 0.02
"""Weight of small values, relative to the motion that one typical value makes."""
LEAST = 20
"""Smallest value that is written."""
STEP = 5
"""Values are multiples of it."""


def read_head(path: Path) -> tuple[object, dict[str, np.ndarray], np.ndarray]:
    """Return a head that moves as its geometry says, displacements (V, 3) by shape, and weights (V,)."""
    options = ImportOptions(path, path.stem)
    pieces, own = gltf_pieces(path)
    if own:
        raise FbaError(
            f"{path}: is a head of this project, whose shapes are made of FAPs: the fit would be circular"
        )
    upright, points, _, _ = locate(pieces, options)
    bare = [replace(piece, morphs={}) for piece in upright]
    model = finish_import(bare, points, {}, options)
    size, _ = metres_per_unit(points)
    pupils = points[[point_rows()["3.5"], point_rows()["3.6"]]]
    placed = [
        shift_piece(piece, size, -pupils.mean(axis=0) * size)
        for piece in assemble(upright, None, middle=float(pupils[:, 0].mean()))
    ]
    names = canonical_names({name for piece in placed for name in piece.morphs})
    shapes = {}
    for shape, written in names.items():
        shapes[shape] = np.concatenate(
            [piece.morphs.get(written, np.zeros((len(piece.part.vertices), 3))) for piece in placed]
        )
    weights = np.concatenate([skin_areas(part) for part in model.parts])
    skin = weights > 0
    weights /= weights.sum()
    bound_points = model.bound[model.bound >= 0]
    bound_points = bound_points[skin[bound_points]]
    weights[bound_points] += POINTS / len(bound_points)
    found = np.concatenate([piece.part.vertices for piece in placed])
    if not np.allclose(found, model.vertices, atol=1e-5):
        raise FbaError(f"{path}: its parts were put together in another order")
    return model, shapes, weights


def skin_areas(part) -> np.ndarray:
    """Return the area (V,) that belongs to each vertex of a part; 0 for those that are no skin."""
    areas = np.zeros(len(part.vertices))
    if part.kind != "skin":
        return areas
    corners = part.vertices[part.triangles].astype(float)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    for corner in range(3):
        np.add.at(areas, part.triangles[:, corner], area / 6)
    return areas


def solve(model, shape: str, wanted: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, float]:
    """Return FAPs (68,) that move a head as a shape does, and the part of its motion that they make."""
    word = re.match("[a-z]+", shape)[0]
    columns = [number - 1 for number in SOLVED[word] if can_move(model, number)]
    if shape == "mouthClose":
        columns.append(2)
    move = Deformer(model).local
    neutral = move(np.zeros(FAP_COUNT))
    used = np.flatnonzero(weights > 0)
    scale = np.sqrt(weights[used])[:, None]
    target = (wanted[used] * scale).ravel()
    values = np.zeros(FAP_COUNT)
    typical = np.array([max(map(abs, bound(number))) / 2 for number in range(1, FAP_COUNT + 1)])
    for _ in range(ROUNDS.get(word, 1)):
        steps = []
        for column in columns:
            step = values[column] if abs(values[column]) > LEAST else typical[column] / 4
            pose = np.zeros(FAP_COUNT)
            pose[with_lip_mate(column)] = step
            steps.append(((move(pose) - neutral)[used] * scale).ravel() / step)
        matrix = np.array(steps).T
        sizes = np.linalg.norm(matrix, axis=0) * typical[columns]
        ridge = np.diag(RIDGE * sizes.max() * np.ones(len(columns)) / typical[columns])
        low, high = np.array([bound(column + 1) for column in columns]).T
        found = lsq_linear(np.vstack([matrix, ridge]), np.append(target, np.zeros(len(columns))), (low, high))
        values[columns] = found.x
    rest = np.linalg.norm(matrix @ values[columns] - target) ** 2
    return values, 1 - rest / max(np.linalg.norm(target) ** 2, 1e-30)


def can_move(model, number: int) -> bool:
    """Whether a FAP moves a head."""
    return number not in model.lost


def with_lip_mate(column: int) -> list[int]:
    """Return columns of a FAP and of the outer lip's FAP that follows it where only inner lips are sent."""
    mate = faps()[column].lip_mate
    return [column] if mate is None else [column, mate - 1]


def bound(number: int) -> tuple[int, int]:
    """Return the smallest and the largest value of a FAP."""
    fap = faps()[number - 1]
    low, high = fap.i_limits or (0, 0)
    return low, high + 1


def mirrored(values: np.ndarray) -> np.ndarray:
    """Return FAPs (68,) of the same face in a mirror."""
    result = np.zeros(FAP_COUNT)
    for fap in faps():
        mate = fap.left_right_mate or fap.number
        sign = -1 if fap.name in ("shift_jaw", "bend_nose", "shift_tongue_tip") or "yaw" in fap.name else 1
        result[mate - 1] = sign * values[fap.number - 1]
    return result


def other_side(shape: str) -> str:
    """Return the shape of the other side: mouthRight for mouthLeft; itself where it has none."""
    return re.sub("Left$|Right$", lambda side: "Right" if side[0] == "Left" else "Left", shape)


def touch(row: str, medians: dict[str, np.ndarray]) -> None:
    """Make lids that close and lips that are brought together touch, and no more."""
    values = medians[row]
    if "Look" in row:
        before = shape_faps(row.split("(", maxsplit=1)[0] + "Left" if "(" in row else row)
        eyes = [fap.number - 1 for fap in faps() if fap.name.startswith(("yaw", "pitch"))]
        values[eyes] = np.sign(before[eyes]) * [MEASURED[faps()[eye].name.split("_")[0]] for eye in eyes]
    if row.startswith("eyeBlink"):
        for upper, lower in LIDS:
            values[upper - 1] = STEP * round(
                values[upper - 1] * CLOSED / (values[upper - 1] + values[lower - 1]) / STEP
            )
            values[lower - 1] = CLOSED - values[upper - 1]
    if row == "mouthClose":
        for upper, lower in LIPS:
            down = min((values[upper - 1] - values[lower - 1]) / 2, LOWEST)
            values[[upper - 1, lower - 1]] = down, -down
        values -= medians["jawOpen"]
        values[2] = 0.0


def correct(row: str, values: np.ndarray) -> None:
    """Change what pictures showed to be wrong."""
    if "Roll" not in row and row not in CORRECTED:
        for name in ("push_b_lip", "push_t_lip"):
            values[fap_numbers()[name] - 1] = max(values[fap_numbers()[name] - 1], BACK)
    for name, value in CORRECTED.get(row, {}).items():
        values[fap_numbers()[name] - 1] = value


def rows() -> list[tuple[str, list[str]]]:
    """Return the rows of ARKit's shapes in the table: their names as written, and the shapes of each."""
    result = []
    for row in csv.DictReader(TABLE.read_text().splitlines()):
        sides = re.search(r"\((\w+)\|(\w+)\)", row["shape"])
        names = [row["shape"].replace(sides[0], word) for word in sides.groups()] if sides else [row["shape"]]
        if names[0] in arkit_names():
            result.append((row["shape"], names))
    return result


def as_text(values: np.ndarray, side: bool) -> str:
    """Return FAPs as the table writes them; those of the left side as of either side where a row has two."""
    words = []
    for fap in faps():
        value = (
            STEP * round(values[fap.number - 1] / STEP)
            if values[fap.number - 1] % 1
            else int(values[fap.number - 1])
        )
        if abs(value) < LEAST:
            continue
        name = fap.name
        if side and fap.left_right_mate is not None:
            if fap.left_right_mate < fap.number:
                continue  # what the other side of the face does is left out
            name = re.sub(r"_l_|_l$|_lm$", lambda found: found[0].replace("l", "?"), name)
        words.append(f"{name}={value}")
    return " ".join(words)


def main() -> None:
    """Fits all shapes to the heads, prints the results, and writes the table if asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("heads", nargs="+", type=Path)
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    fitted: dict[str, list[np.ndarray]] = {}
    shares: dict[str, list[float]] = {}
    for path in arguments.heads:
        model, shapes, weights = read_head(path)
        if "mouthClose" in shapes and "jawOpen" in shapes:  # it corrects an open jaw
            shapes["mouthClose"] = shapes["mouthClose"] + shapes["jawOpen"]
        for shape, wanted in shapes.items():
            if shape in KEPT or shape not in arkit_names() or not np.abs(wanted).max() > 1e-4:
                continue
            values, share = solve(model, shape, wanted, weights)
            fitted.setdefault(shape, []).append(values)
            shares.setdefault(shape, []).append(share)
        print(f"# {path.name}: {len(shapes)} shapes")
    lines = {}
    medians: dict[str, np.ndarray] = {}
    for row, names in rows():
        per_head = [*fitted.get(names[0], []), *map(mirrored, fitted.get(other_side(names[0]), []))]
        if not per_head:
            continue
        median = medians[row] = np.median(per_head, axis=0)
        touch(row, medians)
        correct(row, median)
        share = np.median([one for name in names for one in shares.get(name, [])])
        set_before = shape_faps(names[0])
        lines[row] = as_text(median, len(names) > 1)
        print(f"\n{row}: {share:.0%} of the motion")
        print("  before ", as_text(set_before, len(names) > 1))
        print("  fitted ", lines[row])
        for number in np.flatnonzero(np.abs(per_head).max(axis=0) > 3 * LEAST):
            each = " ".join(f"{values[number]:7.0f}" for values in per_head)
            print(f"    {faps()[number].name:22} {set_before[number]:7.0f} | {each}")
    if arguments.write:
        write(lines)


def write(lines: dict[str, str]) -> None:
    """Replace rows of the table."""
    text = TABLE.read_text().splitlines()
    for number, line in enumerate(text):
        shape = line.partition(",")[0]
        if shape in lines:
            text[number] = f"{shape},{lines[shape]}"
    TABLE.write_text("\n".join(text) + "\n")


if __name__ == "__main__":
    main()
