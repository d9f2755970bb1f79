"""Meshes made ready for drawing: simplified, primitive, textured.

May use: `fba.mesh`. Knows no OpenGL.
"""
