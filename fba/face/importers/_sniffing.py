"""Recognises which importer a file is for, by its content, then by its name."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from fba.errors import FormatError, ModelError
from fba.recognition import recognition_hint
from fba.source import read_head

KINDS: Mapping[str, str] = {
    "makehuman": "MakeHuman's base mesh (base.obj or its folder)",
    "gltf": "glTF heads (.glb, .gltf)",
    "obj": "Wavefront OBJ (.obj) with feature points",
    "ply": "PLY (.ply) with feature points",
    "wfm": "Candide wire frames (.wfm) with feature points",
    "fdp": "FDP files (.fdp) of text or Xface, with their mesh beside them",
}
"""Kinds of sources that can be read, with a description."""
OBJ_WORDS = (b"v ", b"f ", b"vt ", b"vn ", b"g ", b"o ", b"mtllib", b"usemtl", b"s ")


def sniff(path: str | os.PathLike[str]) -> str:
    """Return the kind of a source, one of `KINDS`; ModelError, listing them, for anything else."""
    path = Path(path)
    if path.is_dir():
        from fba.face.importers.makehuman.makehuman import base_file

        base_file(path)
        return "makehuman"
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
