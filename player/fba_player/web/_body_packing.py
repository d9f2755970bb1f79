"""Packs a body for the web player: its joints, how BAPs turn them, and how they carry the vertices."""

from __future__ import annotations

from typing import Any

import numpy as np

from fba.arrays import Int64, Intp
from fba.body import SIDES, AttachedHead, BodyModel, Skeleton
from fba.body.footing import SOLE, has_feet
from fba.body.head_attachment import skull_of
from fba.body.own_head import OwnHead
from fba.body.solve.conventions import convention
from fba_player._figure.body_light import UNOBSTRUCTED_LIGHT
from fba_player._figure.person import Person, head_middle
from fba_player.web._container import Container, rounded
from fba_player.web._face_packing import STEP, Chosen, reduce_parts

WEIGHT_STEP = 1 / 16384
"""Weights and shares of twists are multiples of it."""
FOLD_STEP = 1 / 255
NORMAL_STEP = 1 / 63
"""Coordinates of normals are multiples of it: half a degree."""


def pack_body_parts(container: Container, person: Person, face_rows: Int64) -> tuple[dict[str, Any], Int64]:
    """Return the header of a person's body, and its vertices that stay, in their new order.

    face_rows: those of the face.
    """
    body, head = person.body, person.head
    chosen: list[Chosen] = []
    for part in body.parts:
        shape = person.body_shapes.get(part.name)
        if shape is not None and len(shape.triangles):
            chosen.append((part, shape.triangles, body.starts[part.name], shape))
    # Along seams of textures vertices are there twice, and share their normals.
    seams = np.unique(body.vertices.round(5), axis=0, return_inverse=True)[1].ravel()
    reduced = reduce_parts(container, chosen, seams)
    skull = skull_of(body)
    skeleton, default = body.skeleton, Skeleton.default()
    grounded = has_feet(skeleton) and skeleton is not default
    if head is None:
        turn = {"size": 0.0, "centre": body.bind[skull, :3, 3].tolist()}
        place = {"size": 1.0, "shift": (head_middle(body) - np.array(person.figure.subject.centre)).tolist()}
    else:
        turn = {"size": head.size, "centre": head.place[:3, 3].tolist()}
        place = {"size": head.size, "shift": head.place[:3, 3].tolist()}
    header = {
        "parts": reduced.header,
        "positions": container.add_fractions(body.vertices[reduced.rows], STEP, centred=True),
        "normals": container.add_fractions(body.normals[reduced.rows], NORMAL_STEP),
        "skeleton": _pack_skeleton(skeleton),
        "standard": _pack_skeleton(default) if grounded else None,
        "soles": [_soles(default), _soles(skeleton)] if grounded else [],
        "bind": [matrix.T.ravel().tolist() for matrix in body.bind],
        "light": _pack_light(container, person, reduced.rows),
        "skull": skull,
        "turn": turn,
        "place": place,
        "skin": _pack_skin(container, body, reduced.rows),
        "ownHead": None if body.own_head is None else _pack_own_head(container, body.own_head, reduced.rows),
        "faceSkin": None if head is None else _pack_skin(container, head, face_rows),
    }
    return header, reduced.rows


def _pack_own_head(container: Container, own: OwnHead, rows: Int64) -> dict[str, Any]:
    """Return shapes and eyes of a body's own head. rows: (W,), vertices that stay, in their new order."""
    scales, mixing = own.mixing
    shapes = [_kept(shape.rows, rows) for shape in own.shapes]
    eyes = [_kept(eye.rows, rows) for eye in own.eyes]
    none, still = np.zeros(0, dtype=np.int64), np.zeros((0, 3))
    shifts = [shape.shifts[order] for shape, (_, order) in zip(own.shapes, shapes, strict=True)]
    return {
        "scales": rounded(scales, 12),
        "faps": rounded(mixing[: len(scales)].T, 12),
        "counts": [len(moved) for moved, _ in shapes],
        "rows": container.add_integers(np.concatenate([none, *(moved for moved, _ in shapes)])),
        "shifts": container.add_fractions(np.concatenate([still, *shifts]), STEP),
        "eyes": [
            {"side": SIDES.index(eye.side), "count": len(turned), "centre": rounded(eye.centre)}
            for eye, (turned, _) in zip(own.eyes, eyes, strict=True)
        ],
        "turned": container.add_integers(np.concatenate([none, *(turned for turned, _ in eyes)])),
    }


def _kept(listed: Intp, rows: Int64) -> tuple[Int64, Int64]:
    """Return the new numbers of those vertices that stay, ascending, and their places in the list."""
    number = np.full(max(rows.max(initial=-1), listed.max(initial=-1)) + 1, -1)
    number[rows] = np.arange(len(rows))
    places = np.argsort(number[listed], kind="stable")
    places = places[number[listed][places] >= 0]
    return number[listed][places], places


def _pack_light(container: Container, person: Person, rows: Int64) -> dict[str, Any]:
    """Return the light on a body: what its folds leave of the sky, and the limbs that keep light from others.

    light: that of a place without either, as `FaceMesh.light`. limbs: joints at both ends, and radius (m).
    """
    light = person.light
    ends = zip(light.ends.tolist(), rounded(light.radii), strict=True)
    return {
        "light": UNOBSTRUCTED_LIGHT,
        "open": container.add_fractions(light.open_sky[rows, None], FOLD_STEP),
        "limbs": [[*joints, radius] for joints, radius in ends],
    }


def _pack_skeleton(skeleton: Skeleton) -> dict[str, Any]:
    """Return a skeleton and the angles of its joints, outermost first: column of the BAP, axis, sign."""
    rules = convention("iso")
    row = {joint: number for number, joint in enumerate(rules.joints)}
    return {
        "names": skeleton.names,
        "parents": skeleton.parents.tolist(),
        "offsets": rounded(skeleton.offsets.ravel(), 12),
        "turns": [
            [
                [int(rules.bap[row[name], k]), int(rules.axis[row[name], k]), int(rules.sign[row[name], k])]
                for k in range(len(rules.freedoms(name)))
            ]
            for name in skeleton.names
        ],
        "translation": rules.translation.tolist(),
        "metres": (rules.translation_sign / 1000).tolist(),
    }


def _soles(skeleton: Skeleton) -> list[list[float]]:
    """Return the points of both soles: the joint that moves each, and its place relative to that joint."""
    points = []
    for side, outwards in zip(SIDES, (1.0, -1.0), strict=True):
        for joint, x, y, z in SOLE:
            number = skeleton.number(f"{side}_{joint}")
            points.append([number, *rounded([outwards * x, y - skeleton.centres[number, 1], z], 12)])
    return points


def _pack_skin(container: Container, carried: BodyModel | AttachedHead, rows: Int64) -> dict[str, Any]:
    """Return how joints carry vertices. rows: (W,), those that stay, in their new order."""
    skinner = carried.skinner
    number = np.full(len(skinner.vertices), -1)
    number[rows] = np.arange(len(rows))
    twists, girdle = skinner.twists, skinner.girdle
    weights = skinner.weights[rows]
    turned, shares, bones = [np.zeros(0, dtype=np.int64)], [np.zeros((0, 2))], []
    for bone in range(len(twists.joint)):
        own = slice(int(twists.starts[bone]), int(twists.starts[bone + 1]))
        kept = number[twists.rows[own]]
        order = np.argsort(kept)[np.count_nonzero(kept < 0) :]
        turned.append(kept[order])
        shares.append(twists.shares[own][order])
        bones.append(
            {
                "joint": int(twists.joint[bone]),
                "child": int(twists.child[bone]),
                "count": len(order),
                "centre": twists.centre[bone].tolist(),
                "axis": twists.axis[bone].tolist(),
                "childAxis": twists.child_axis[bone].tolist(),
            }
        )
    armpits = number[girdle.rows]
    order = np.argsort(armpits)[np.count_nonzero(armpits < 0) :]
    return {
        "joints": container.add_integers(np.where(weights > 0, skinner.joints[rows], 0)),
        "weights": container.add_fractions(weights[:, 1:], WEIGHT_STEP),
        "bones": bones,
        "turned": container.add_integers(np.concatenate(turned)),
        "shares": container.add_fractions(np.concatenate(shares), WEIGHT_STEP),
        "girdles": [
            {"joints": joints.tolist(), "centre": centre.tolist(), "arm": arm.tolist()}
            for joints, centre, arm in zip(girdle.joints, girdle.centre, girdle.arm, strict=True)
        ],
        "armpits": container.add_integers(armpits[order]),
        "straight": container.add_fractions(girdle.shares[order][:, None], WEIGHT_STEP),
    }
