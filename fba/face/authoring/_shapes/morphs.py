"""Makes a face model from a mesh with shapes: the 52 of ARKit, or one for each FAP.

How far each shape moves each feature point is measured. For each group of FAPs that shapes move together
(a brow, a lip), in each direction, shapes are mixed so that the group's points move as the standard says and
the others as little as possible. Errors that remain at the points are corrected with the tables that `author`
makes from the mesh alone: every point moves exactly as far as its FAP says, and between the points the
sculptor's shapes show.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fba.errors import warn
from fba.face._tables import FaceDefTables
from fba.face.authoring._author import author_lids
from fba.face.authoring._shapes._mixing import GROUPS, Mixer, fold_limited_tables
from fba.face.authoring._shapes._shapes import Morphs, Shapes, check_shapes
from fba.face.model import FaceModel
from fba.face.shape_names import canonical_names, fap_of
from fba.parameters import faps

if TYPE_CHECKING:
    pass

EMPTY_SHAPE_MOTION = 1e-7
"""Metres up to which a shape moves its vertices that counts as empty."""
MIN_FAPS = 5
"""Number of shapes named after FAPs at which only these are used."""
ARCS = frozenset((3, *range(19, 31), *range(43, 51)))
"""FAPs whose points move on arcs: jaw, lids, eyeballs, tongue, head. A shape is straight, and is used for
these only where the mesh alone gives no table."""
LID_SHAPES = {
    19: ("eyeBlinkLeft",),
    20: ("eyeBlinkRight",),
    21: ("eyeBlinkLeft", "eyeSquintLeft"),
    22: ("eyeBlinkRight", "eyeSquintRight"),
}
"""Shapes that show how the skin of a lid moves with its margin; the first that moves it is used."""
REPLACEMENT_SHAPES = {
    3: ("jawOpen", "mouthClose"),
    19: ("eyeBlinkLeft",),
    20: ("eyeBlinkRight",),
    45: ("tongueOut",),
}
"""Shapes that are used for FAPs where the mesh alone gives no table."""


def add_shapes(base: FaceModel, morphs: Morphs) -> FaceModel:
    """Return a face that `author` made, with tables from named shapes where they suffice.

    morphs: displacements float32 (V, 3), metres, at weight 1, by the names of the shape and of the part;
    shapes are named as ARKit's blendshapes (synonyms: `arkit.csv`) or as FAPs. Others are ignored.

    FAPs for which neither suffices are in `lost`. ModelError where displacements do not fit their part.
    """
    moving = {
        shape: moved
        for shape, moved in morphs.items()
        if any(
            np.abs(np.asarray(part, dtype=np.float64)).max(initial=0.0) > EMPTY_SHAPE_MOTION
            for part in moved.values()
        )
    }
    if moving:  # shapes that a converter left empty show nothing
        morphs = moving
    by_fap = {number: shape for shape in morphs if (number := fap_of(shape)) is not None}
    if len(by_fap) >= MIN_FAPS:
        shapes = check_shapes(base, {shape: morphs[shape] for shape in by_fap.values()})
        return _from_faps(base, shapes, by_fap)
    known = canonical_names(morphs)
    shapes = check_shapes(base, {shape: morphs[written] for shape, written in known.items()})
    if not shapes.halves:
        if morphs:
            warn(
                f"none of the {len(morphs)} shapes is named after one of ARKit's blendshapes or a FAP "
                f"({', '.join(sorted(morphs)[:4])}); the tables are made from the mesh alone",
                stacklevel=2,
            )
        return base
    return _from_arkit(base, shapes)


def _from_arkit(base: FaceModel, shapes: Shapes) -> FaceModel:
    """Return the face with tables from ARKit's shapes."""
    mixer = Mixer(base, shapes)
    tables: dict[int, FaceDefTables] = dict(base.table_of)
    used: set[str] = set()
    for group in GROUPS:
        made, names = mixer.tables(group)
        tables |= made
        used |= names
    lost = dict(base.lost)
    closing = {
        fap: [shapes.displacements(name) for name in names if name in shapes.morphs]
        for fap, names in LID_SHAPES.items()
    }
    for fap, lid in author_lids(base, closing).items():
        tables[fap] = lid
        lost.pop(fap, None)
        used.add(next(name for name in LID_SHAPES[fap] if name in shapes.morphs))
    for fap, wanted in REPLACEMENT_SHAPES.items():
        if fap in lost and wanted[0] in shapes.morphs:
            table = mixer.replacement_tables(fap, [shape for shape in wanted if shape in shapes.morphs])
            if table is not None:
                tables[fap] = table
                used |= set(wanted) & set(shapes.morphs)
                del lost[fap]
    notes_with_shapes = {
        **base.notes,
        "shapes": f"of {len(shapes.morphs)} ARKit shapes used: {', '.join(sorted(used)) or 'none'}",
    }
    return replace(base, tables=tuple(tables.values()), lost=lost, notes=notes_with_shapes)


def _from_faps(base: FaceModel, shapes: Shapes, by_fap: Mapping[int, str]) -> FaceModel:
    """Return the face with tables from shapes that show one FAP each, at its value in `morph_values`."""
    from fba.face.gltf.morphs import morph_values

    tables: dict[int, FaceDefTables] = dict(base.table_of)
    lost = dict(base.lost)
    for fap, shape in by_fap.items():
        if fap in ARCS and fap in tables:
            continue
        step = shapes.displacements(shape) / morph_values()[fap]
        made = fold_limited_tables(shapes, fap, step, step)
        if made is not None:
            tables[fap] = made
            lost.pop(fap, None)
    notes_with_shapes = {
        **base.notes,
        "shapes": f"{len(by_fap)} shapes named after FAPs, such as {faps()[min(by_fap) - 1].name}",
    }
    return replace(base, tables=tuple(tables.values()), lost=lost, notes=notes_with_shapes)
