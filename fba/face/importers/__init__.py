"""Faces made by others: MakeHuman, FDP files, OBJ and PLY meshes, glTF heads with morph targets."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from fba.choices import UpAxis
from fba.errors import ModelError, OptionError
from fba.face.importers._sniffing import KINDS, sniff
from fba.face.model import FaceModel
from fba.limits import DEFAULT_LIMITS, Limits

if TYPE_CHECKING:
    from fba.face.importers.assembly.model import ImportOptions

__all__ = ["KINDS", "import_model", "sniff"]


def import_model(
    path: str | os.PathLike[str],
    *,
    kind: str | None = None,
    points: object = None,
    unit: float | None = None,
    up: UpAxis = "y",
    kinds: Mapping[str, str] | None = None,
    name: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> FaceModel:
    """Return a face model from a file that knows nothing of FAPs, with tables for all FAPs that it can serve.

    path: a file, or MakeHuman's folder. kind: one of `KINDS`, by default recognised.
    points: the feature points, as the path of a CSV, JSON or FDP file, an array (84, 3) in the file's
    unit with NaN where unknown, or a mapping from names to a position or a vertex number; by default they
    are read from a file of the mesh's name beside it (.points.csv, .points.json, .fdp), or located by the
    shapes of a glTF head. unit: metres per unit, by default judged by the distance of the pupils. up: the
    file's vertical axis, "y" or "z". kinds: kind of part ("none" to leave it out) by the name of a group,
    object, mesh or material, where that name does not say. name: of the model. limits: of a glTF head, see
    `fba.Limits`.

    Raises ModelError for a file that is damaged, unknown (it lists what is read) or lacks what a face
    needs; OptionError for options that do not fit. FAPs that cannot be served are in `lost`.
    """
    form = sniff(path) if kind is None else kind
    if form not in KINDS:
        raise OptionError(f"kind must be one of {', '.join(KINDS)}, not {kind!r}")
    try:
        if form == "makehuman":
            from fba.face.importers.makehuman.makehuman import import_makehuman

            turned = None if up == "y" else up
            _refuse_options("MakeHuman's base mesh", points=points, unit=unit, kinds=kinds, up=turned)
            return import_makehuman(path, name=name or "MakeHuman")
        from fba.face.importers.assembly.model import ImportOptions

        options = ImportOptions(path, name or Path(path).stem or "face", unit, up, kinds, limits)
        return _import(form, options, points)
    except ModelError as error:
        if Path(path).name in error.finding:
            raise
        raise ModelError(f"{os.fspath(path)}: {error.finding}").with_remedies(*error.remedies) from error


def _import(form: str, options: ImportOptions, points: object) -> FaceModel:
    """Return the face of a file of a known kind."""
    if form == "fdp":
        from fba.face.importers._fdp import import_fdp

        _refuse_options("an FDP file", points=points)
        return import_fdp(options)
    if form == "gltf":
        from fba.face.importers._gltf import import_gltf

        return import_gltf(options, points)
    from fba.face.importers._mesh import import_mesh

    return import_mesh(options, form, points)


def _refuse_options(what: str, **options: object) -> None:
    for option, value in options.items():
        if value is not None:
            raise OptionError(f"{option} does not apply to {what}, which has its own")
