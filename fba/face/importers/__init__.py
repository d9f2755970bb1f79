"""Faces made by others: MakeHuman, FDP files, OBJ and PLY meshes, heads with morph targets."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from fba.choices import UpAxis
from fba.errors import FormatError, ModelError, OptionError
from fba.face.model import FaceModel
from fba.limits import DEFAULT_LIMITS, Limits
from fba.recognition import recognition_hint
from fba.source import read_head

if TYPE_CHECKING:
    from fba.face.importers.assembly.model import ImportOptions

__all__ = ["KINDS", "import_model", "sniff"]

KINDS: Mapping[str, str] = {
    "makehuman": "MakeHuman's base mesh (base.obj or its folder)",
    "gltf": "glTF heads (.glb, .gltf)",
    "shapes": "folders of OBJ files: one with 'neutral' in its name, and one for each shape (jawOpen.obj)",
    "obj": "Wavefront OBJ (.obj) with feature points",
    "ply": "PLY (.ply) with feature points",
    "wfm": "Candide wire frames (.wfm) with feature points",
    "fdp": "FDP files (.fdp) of text or Xface, with their mesh beside them",
}
"""Kinds of sources that can be read, with a description."""
OBJ_WORDS = (b"v ", b"f ", b"vt ", b"vn ", b"g ", b"o ", b"mtllib", b"usemtl", b"s ")


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

    path: a file, MakeHuman's folder, or one of shapes. kind: one of `KINDS`, by default recognised.
    points: the feature points, as the path of a CSV, JSON or FDP file, an array (84, 3) in the file's
    unit with NaN where unknown, or a mapping from names to a position or a vertex number; by default they
    are read from a file of the mesh's name beside it (.points.csv, .points.json, .fdp), or located by the
    shapes of the head. unit: metres per unit, by default judged by the distance of the pupils. up: the
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
        from fba.face.importers._mesh import import_fdp

        _refuse_options("an FDP file", points=points)
        return import_fdp(options)
    if form == "gltf":
        from fba.face.importers._gltf import import_gltf

        return import_gltf(options, points)
    if form == "shapes":
        from fba.face.importers._shaped import import_shape_folder

        return import_shape_folder(options, points)
    from fba.face.importers._mesh import import_mesh

    return import_mesh(options, form, points)


def _refuse_options(what: str, **options: object) -> None:
    for option, value in options.items():
        if value is not None:
            raise OptionError(f"{option} does not apply to {what}, which has its own")


def sniff(path: str | os.PathLike[str]) -> str:
    """Return the kind of a source, one of `KINDS`; ModelError, listing them, for anything else."""
    path = Path(path)
    if path.is_dir():
        return _kind_of_folder(path)
    try:
        head = read_head(path)
    except FormatError as error:
        raise ModelError(str(error)) from error
    kind = _kind_of_content(head, path)
    if kind is None:
        reads = "; ".join(KINDS.values())
        hint = recognition_hint(head)
        raise ModelError(f"{path}: no face can be read from this file{hint}. Files that can be read: {reads}")
    return kind


def _kind_of_folder(path: Path) -> str:
    from fba.face.importers._shaped import neutral_file
    from fba.face.importers.makehuman.makehuman import base_file

    try:
        base_file(path)
    except ModelError:
        if neutral_file(path) is None:
            raise
        return "shapes"
    return "makehuman"


def _kind_of_content(head: bytes, path: Path) -> str | None:
    suffix = path.suffix.lower()
    start = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    if head.startswith(b"glTF") or (start.startswith(b"{") and (b'"asset"' in head or suffix == ".gltf")):
        return "gltf"
    if head.startswith((b"ply\n", b"ply\r")):
        return "ply"
    if start.startswith(b"<") and b"<xfdp" in head:
        return "fdp"
    lines = [line.strip() for line in head.splitlines()]
    telling = [line for line in lines if line and not line.startswith(b"#")]
    if b"basemesh hm08" in head and any(line.startswith(b"v ") for line in telling):
        return "makehuman" if path.name.lower() == "base.obj" else "obj"
    if suffix in (".obj", ".ply", ".wfm", ".fdp", ".glb", ".gltf"):
        return {".glb": "gltf"}.get(suffix, suffix[1:])
    if telling and telling[0].startswith(b"1.0 ") and len(telling) > 1 and b"." in telling[1].split()[0]:
        return "fdp"
    if telling and sum(line.startswith(OBJ_WORDS) for line in telling) > len(telling) // 2:
        return "obj"
    return None
