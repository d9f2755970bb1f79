"""MakeHuman's base mesh, targets and clothes, as a face.

May use: meshes and the assembly of imported pieces.
"""
