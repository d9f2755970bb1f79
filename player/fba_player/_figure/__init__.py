"""The face and the person as they are shown: deformed meshes, eyes, light, textures.

May use: view, mesh, `fba.face`, `fba.body`. Knows no OpenGL.
"""
