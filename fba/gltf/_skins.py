"""Skins of a glTF file: the joints that carry a mesh."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.gltf._accessors import Accessors
from fba.gltf.document import MAX_ITEMS, Document
from fba.gltf.scene import Skin
from fba.gltf.values import Value


def read_skins(document: Document, accessors: Accessors, nodes: int) -> tuple[Skin, ...]:
    """All skins, in order; nodes: how many there are."""
    return tuple(
        _skin(document, accessors, entry, n, nodes) for n, entry in enumerate(document.entries("skins"))
    )


def _skin(document: Document, accessors: Accessors, entry: Value, number: int, nodes: int) -> Skin:
    name = entry.get("name")
    listed = entry.member("joints")
    entries = listed.elements(MAX_ITEMS)
    document.budget.charge(len(entries) * 1024, entry)
    joints = tuple(value.index(nodes, "node") for value in entries)
    if not joints:
        raise listed.error("a skin needs at least one joint")
    if len(set(joints)) < len(joints):
        raise listed.error("a node is listed twice")
    return Skin(
        name=f"skin {number}" if name is None else name.text(),
        joints=joints,
        inverse_bind=_inverse_bind(accessors, entry, len(joints)),
    )


def _inverse_bind(accessors: Accessors, entry: Value, count: int) -> Float64:
    reference = entry.get("inverseBindMatrices")
    if reference is None:
        matrices = np.broadcast_to(np.eye(4), (count, 4, 4))
    else:
        flat = accessors.floats(reference, "MAT4")
        if len(flat) < count:
            raise reference.error(f"{len(flat)} matrices for {count} joints")
        # column by column in the file
        matrices = flat[:count].astype(np.float64).reshape(count, 4, 4).transpose(0, 2, 1).copy()
    matrices.flags.writeable = False
    return matrices
