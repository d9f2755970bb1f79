"""Triangle meshes: materials, normals, checks, and readers of mesh files (OBJ, PLY, VRML, WFM).

May use: errors, files, arrays. Knows no face and no body.
"""
