"""Makes what differs in the other figures from the built-in person: `fba/figures/NAME.npz`.

    python -m tools.figure.make_figures

To be run after each change of `head.glb` or `body.glb`.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from fba.arrays import Float32, Float64, Int32
from fba.body import BodyModel, Skeleton
from fba.face import Deformer, FaceModel
from fba.face.calibration import reshape as carry
from fba.face.checks._fap_checks import TURNING
from fba.face.model import shape_key
from fba.figures import STEP
from fba.parameters import faps
from tools.figure import arms, figure, make_baked, make_head
from tools.figure.looks import ALEX, FIGURES, Looks, reshape
from tools.figure.sculpt import ORIGIN

BUILTIN = Path(__file__).parents[2] / "fba"
ROUNDS = 8
LIMB = ("shoulder", "elbow", "wrist")


def make_figure(looks: Looks) -> dict[str, np.ndarray]:
    """Return the arrays of a figure's file, by name: see `fba.figures`."""
    head = FaceModel.load(BUILTIN / "face" / "builtin" / "head.glb")
    body = BodyModel.load(BUILTIN / "body" / "builtin" / "body.glb")
    parts, points, _ = make_head.parts_and_points(looks)
    moves = steps(np.concatenate([part.vertices for part in parts]) - head.vertices)
    skin = next(part for part in parts if part.kind == "skin")
    eye = next(part for part in parts if part.kind == "eye")
    assert skin.material.texture is not None
    assert eye.colours is not None
    offset = ORIGIN + np.array([0.0, figure.EYE_LEVEL, 0.0])
    moved = reshape(looks, slim_arms(looks, body) - offset) + offset
    moved, bind = in_build(looks, body, moved)
    tints = {"shirt": looks.shirt, "trousers": looks.trousers, "shoes": looks.shoes}
    tints["skin"] = tints["neck"] = linear(looks.neck) / linear(ALEX.neck)
    tints["hair"] = np.mean([linear(c) for c in looks.hair.colours], axis=0) / np.mean(
        [linear(c) for c in ALEX.hair.colours], axis=0
    )
    gloss = {name: looks.gloss if name in ("skin", "neck") else 1.0 for name in tints}
    tints = {name: np.append(tint, gloss[name]) for name, tint in tints.items()}
    head_tints = tints | {"skin": np.append(np.ones(3), looks.gloss)}  # its picture has the colour
    return {
        "face": np.array(shape_key(head.parts)),
        "face_moves": settle(head, moves, points),
        "face_tints": np.array([head_tints.get(part.name, np.ones(4)) for part in head.parts], np.float32),
        "points": points.astype(np.float32),
        "eye": eye.colours.astype(np.float16),
        "picture": np.frombuffer(skin.material.texture, np.uint8),
        "body": np.array(shape_key(body.parts)),
        "body_moves": steps(moved - body.vertices),
        "body_bind": bind.astype(np.float32),
        "body_centres": hanging(body.skeleton, bind).astype(np.float32),
        "body_tints": np.array([tints[part.name] for part in body.parts], np.float32),
    }


def in_build(looks: Looks, body: BodyModel, moved: Float64) -> tuple[Float64, Float64]:
    """Return vertices (V, 3) and bind matrices (J, 4, 4) of the body in the build of a figure.

    moved: the vertices in the first figure's build.
    """
    bind = body.bind.copy()
    if looks.build is None:
        return moved, bind
    arms = [body.skeleton.number(f"{side}_shoulder") for side in "lr"]
    share = carried_share(body, arms[0]) + carried_share(body, arms[1])
    of_arm = np.isin(np.arange(len(bind)), [n for arm in arms for n in body.skeleton.descendants(arm)])
    joints = bind[:, :3, 3].copy()
    bind[:, :3, 3] = looks.build.move(joints, of_arm.astype(np.float64), joints[arms])
    looks.build.turn_arms(bind, body.skeleton)
    return looks.build.move(moved, share, joints[arms]), bind


def hanging(skeleton: Skeleton, bind: Float64) -> Float64:
    """Return (J, 3), where joints with bind matrices (J, 4, 4) are in the default posture."""
    centres = bind[:, :3, 3].copy()
    for number, above in enumerate(skeleton.parents):
        if above >= 0:
            gap = bind[number, :3, 3] - bind[above, :3, 3]
            centres[number] = centres[above] + bind[above, :3, :3].T @ gap
    return centres


def slim_arms(looks: Looks, body: BodyModel) -> Float64:
    """Return the first figure's body (V, 3) with the girth and the muscles of another's arms."""
    names, moved = body.skeleton, body.vertices.astype(np.float64)
    standing = np.tile(np.eye(4), (len(names), 1, 1))
    standing[:, :3, 3] = names.centres
    hanging = body.skin(standing)
    left = names.centres[[names.number(f"l_{joint}") for joint in LIMB]]
    for side, sign in (("l", 1.0), ("r", -1.0)):
        joints = [names.number(f"{side}_{joint}") for joint in LIMB]
        arm, _, hand = (carried_share(body, joint) for joint in joints)
        share = (arm - hand)[:, None]
        mirrored = hanging * (sign, 1.0, 1.0)
        _, _, outward = arms.arm_place(mirrored, left)
        height = (arms.shape_arm(mirrored, left, arm > 0) * outward).sum(axis=1, keepdims=True)
        moved -= share * (1 - looks.muscles) * height * body.normals
        bone = nearest(body.vertices, body.bind[joints, :3, 3])
        moved += share * (1 - looks.girth) * (bone - body.vertices)
    return moved


def carried_share(body: BodyModel, joint: int) -> Float64:
    """Return (V,) weight with which a joint and those below it carry each vertex."""
    below = np.isin(body.joints, body.skeleton.descendants(joint))
    return (body.weights * below).sum(axis=1, dtype=np.float64)


def nearest(points: Float32, line: Float64) -> Float64:
    """Return the points (N, 3) of a line through corners (K, 3) that are nearest to points (N, 3)."""
    found = []
    for start, end in pairwise(line):
        along = np.clip((points - start) @ (end - start) / ((end - start) ** 2).sum(), 0, 1)
        found.append(start + along[:, None] * (end - start))
    away = [np.linalg.norm(points - each, axis=1) for each in found]
    return np.asarray(np.stack(found)[np.argmin(away, axis=0), np.arange(len(points))])


def steps(moves: Float64) -> np.ndarray:
    """Return moves (V, 3) in metres as whole steps."""
    return np.rint(moves / STEP).astype(np.int16)


def settle(head: FaceModel, moves: np.ndarray, points: Float64) -> np.ndarray:
    """Return moves (V, 3), in steps, with which only those triangles turn over that do on the head as well.

    Where three vertices lie almost in line, they are moved together.
    """
    known, triangles, moves = turned_over(head), head.part("skin").triangles, moves.copy()
    for _ in range(ROUNDS):
        over = (turned_over(carry(head, head.vertices + moves * STEP, points)) & ~known).any(axis=0)
        if not over.any():
            return moves
        for corners in triangles[over]:  # keeps the shape that it has on the head
            moves[corners] = np.rint(moves[corners].mean(axis=0))
    raise SystemExit(f"{over.sum()} triangles turn over: change shapes.csv")


def turned_over(face: FaceModel) -> np.ndarray:
    """Return (L, F), which of the skin's triangles turn over at each limit of each FAP."""
    skin, found = face.part("skin"), []
    still = normals(face.vertices, skin.triangles)
    for fap in faps()[2:]:
        for limit in fap.i_limits or () if fap.number not in TURNING else ():
            values = np.zeros(len(faps()), np.float32)
            values[fap.number - 1] = limit * fap.step
            moved = normals(Deformer(face).local(values), skin.triangles)
            found.append((still * moved).sum(axis=1) < 0)
    return np.stack(found)


def normals(vertices: Float32, triangles: Int32) -> Float64:
    """Return (F, 3) normals of triangles, as long as twice their areas; the skin comes first of all parts."""
    a, b, c = (vertices[triangles[:, k]].astype(np.float64) for k in range(3))
    return np.cross(b - a, c - a)


def linear(colour: tuple[float, float, float]) -> Float64:
    """Return (3,) linear light of an sRGB colour, 0..255."""
    shown = np.array(colour) / 255
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)


def main() -> None:
    """Write the files and say how large they are."""
    for looks in FIGURES:
        if looks is not ALEX:
            path = BUILTIN / "figures" / f"{looks.name}.npz"
            np.savez_compressed(path, **make_figure(looks))
            print(f"{path}: {path.stat().st_size} bytes")
    make_baked.main()


if __name__ == "__main__":
    main()
