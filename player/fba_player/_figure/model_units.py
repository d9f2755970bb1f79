"""Prepares a face model for display: scales it to a person's size, and warns about what it lacks."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from fba.errors import FbaWarning
from fba.face import FaceDefTables, FaceModel
from fba.parameters import faps

SIZES = (0.01, 1.0)
"""Distances between the eyes (m) that are taken for metres: from dolls to giants."""
EYES_APART = 0.062
"""Distance between an adult's pupils, metres."""
EXPECTED = {"eye": "eyes", "teeth": "teeth"}


def prepare_model(model: FaceModel) -> FaceModel:
    """Return the model, or a copy scaled to a person's size if its unit cannot be metres.

    Gives an FbaWarning for such a unit, for missing eyes or teeth, and for missing FaceDefTables.
    """
    named = f"the face {model.name!r}" if model.name else "the face"
    missing = [plural for kind, plural in EXPECTED.items() if not model.of_kind(kind)]
    if missing:
        _warn(f"{named} has no {' and no '.join(missing)}: it is shown without")
    if not model.tables:
        _warn(f"{named} has no FaceDefTables: no FAP moves it (fba.face.authoring makes them)")
    apart = model.fapu.ES * 1024
    if SIZES[0] <= apart <= SIZES[1]:
        return model
    _warn(f"{named} is in other units than metres: {apart:.3g} between its eyes; shown as large as a person")
    return resize(model, EYES_APART / apart)


def resize(model: FaceModel, factor: float) -> FaceModel:
    """Return a copy of the face, `factor` times as large."""
    return replace(
        model,
        parts=tuple(
            replace(part, vertices=(part.vertices * np.float64(factor)).astype(np.float32))
            for part in model.parts
        ),
        points=model.points * factor,
        tables=tuple(_resize_table(table, factor) for table in model.tables),
    )


def _resize_table(table: FaceDefTables, factor: float) -> FaceDefTables:
    # Displacements are in the face's own units; angles scale only if the FAP's unit is a length.
    is_angle = faps()[table.fap - 1].unit == "AU"
    shift, angle = (factor, 1.0) if is_angle else (1.0, 1.0 / factor)
    transforms = []
    for transform in table.transforms:
        by = shift if transform.kind == "translation" else angle
        x, y, z = (float(v) * by for v in transform.amount)
        a, b, c = (float(v) * factor for v in transform.centre)
        transforms.append(replace(transform, amount=(x, y, z), centre=(a, b, c)))
    moves = [replace(mesh, displacements=mesh.displacements * np.float32(shift)) for mesh in table.meshes]
    return replace(table, transforms=tuple(transforms), meshes=tuple(moves))


def _warn(text: str) -> None:
    warnings.warn(text, FbaWarning, stacklevel=4)  # the caller of Scene
