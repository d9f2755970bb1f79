"""Triangle meshes: materials, normals, checks, and readers of mesh files (OBJ, PLY, VRML, WFM)."""

from fba.mesh._materials import Pictures, read_mtl, read_pixels
from fba.mesh._meshes import (
    Alpha,
    Material,
    Mesh,
    Meshes,
    UniqueNames,
    checked_rows,
    connected,
    join_rows,
    mesh_arrays,
    result_array,
    vertex_normals,
)
from fba.mesh._obj import read_obj
from fba.mesh._ply import read_ply
from fba.mesh._polygons import Polygons, triangulate
from fba.mesh._vrml import read_vrml
from fba.mesh._wfm import read_wfm

__all__ = [
    "Alpha", "Material", "Mesh", "Meshes", "Pictures", "Polygons", "UniqueNames", "checked_rows",
    "connected", "join_rows", "mesh_arrays", "read_mtl", "read_obj", "read_pixels", "read_ply", "read_vrml",
    "read_wfm", "result_array", "triangulate", "vertex_normals",
]  # fmt: skip
