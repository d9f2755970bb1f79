"""Primitives packed by Draco (KHR_draco_mesh_compression), read by the package DracoPy where installed.

Without it the file is refused with a remedy: Draco's own code is C++, and too large to write again.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fba.arrays import Array
from fba.gltf._accessors import Accessors
from fba.gltf._document import Document, find_extension
from fba.gltf._values import Value

DRACO = "KHR_draco_mesh_compression"
TRIANGLES = 4


def unpack_primitive(document: Document, accessors: Accessors, primitive: Value) -> None:
    """Fill the accessors of a primitive that Draco packed; others are left as they are.

    Raises ModelError where the package is missing, or the data are damaged or of another size than the
    accessors say.
    """
    packing = find_extension(primitive, DRACO)
    if packing is None:
        return
    given = primitive.get("mode")
    if given is not None and given.integer(0, 6) != TRIANGLES:
        raise given.error("only lists of triangles are read from Draco's data; convert the file without it")
    attributes, numbers = primitive.member("attributes"), packing.member("attributes")
    wanted = {name: (attributes.member(name), value) for name, value in numbers.members()}
    for reference, _ in wanted.values():
        accessors.charge(reference)
    accessors.charge(primitive.member("indices"))
    data, view = document.view(packing.member("bufferView"))
    mesh = _decode(bytes(data), packing, view)
    columns = {int(each["unique_id"]): each["data"] for each in mesh.attributes}
    for reference, value in wanted.values():
        number = value.integer(0, 1 << 16)
        if number not in columns:
            raise value.error(f"Draco's data in {view.path} have no attribute {number}")
        accessors.fill(reference, _as_columns(columns[number]))
    accessors.fill(primitive.member("indices"), _as_columns(np.asarray(mesh.faces).reshape(-1)))


def _decode(data: bytes, packing: Value, view: Value) -> Any:
    try:
        import DracoPy
    except ImportError:
        raise packing.error(
            'the mesh is packed by Draco, which DracoPy reads: pip install "mpeg4-fba[draco]". Or convert '
            "the file: npx @gltf-transform/cli copy in.glb out.glb"
        ) from None
    try:
        mesh = DracoPy.decode(data)
    except Exception as error:  # the package has several kinds for damaged data
        raise view.error(f"Draco's data are damaged: {error}") from None
    if not isinstance(mesh, DracoPy.DracoMesh):
        raise view.error("Draco's data are a cloud of points, not a mesh")
    return mesh


def _as_columns(values: Any) -> Array:
    array: Array = np.asarray(values)
    return array.reshape(len(array), -1)
