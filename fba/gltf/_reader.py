"""glTF 2.0 files read into plain arrays: `read_gltf`.

It reads triangles with morph targets and skins, the tree of nodes, metallic-roughness materials with PNG or
JPEG textures, and animations. Everything is checked before it is used or allocated.
"""

from __future__ import annotations

import warnings

from fba.errors import FbaWarning
from fba.gltf._accessors import Accessors
from fba.gltf._animations import read_animations
from fba.gltf._document import Document, open_document
from fba.gltf._materials import read_materials
from fba.gltf._meshes import read_meshes
from fba.gltf._nodes import read_nodes, read_roots, read_skins
from fba.gltf._scene import Gltf
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path

PACKED = {
    "KHR_meshopt_compression": "meshopt-compressed buffers",
}
"""Extensions by which the geometry itself is compressed."""
KNOWN = {
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_lights_punctual",
    "FBA_face",
}
"""Extensions that a file may require: they are read, or do not change shapes."""


def read_gltf(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> Gltf:
    """Return the content of a .glb or .gltf file.

    Buffers and pictures may be in the file, in data URIs, or in files in the same folder or below it. Points,
    lines, and pictures that are neither PNG, JPEG nor WebP are left out with an FbaWarning. FormatError where
    the file cannot be opened; ModelError, which names the place in the document, where it is damaged, too
    large, or requires an unknown extension; LimitError where it takes more memory than the limits allow.
    """
    return read_document(open_document(path, limits))


def read_document(document: Document) -> Gltf:
    """Return the content of an opened document; errors and warnings as `read_gltf`."""
    _check_extensions(document)
    accessors = Accessors(document)
    materials = read_materials(document)
    meshes = read_meshes(document, accessors, len(materials))
    skins = read_skins(document, accessors, len(document.entries("nodes")))
    nodes, order = read_nodes(document, meshes, skins)
    return Gltf(
        file=document.root.file,
        meshes=meshes,
        nodes=nodes,
        skins=skins,
        materials=materials,
        animations=read_animations(document, accessors, nodes, meshes),
        roots=read_roots(document, nodes),
        order=order,
        document=document.root,
        accessors=accessors,
        budget=document.budget,
    )


def _check_extensions(document: Document) -> None:
    for entry in document.root.elements(1000, "extensionsRequired"):
        name = entry.text(200)
        if name in PACKED:
            raise entry.error(
                f"{name}: {PACKED[name]} are not read; convert the file without compression: "
                "npx @gltf-transform/cli copy in.glb out.glb"
            )
        if name not in KNOWN and not name.startswith("KHR_materials_"):
            if "texture" in name:  # another kind of picture: shapes can be read without it
                warnings.warn(f"{entry.file}: {name} cannot be read; left out", FbaWarning, stacklevel=3)
                continue
            raise entry.error(f"the file needs the extension {name}, which fba does not support")
