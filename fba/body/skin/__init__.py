"""Skinning, vertices moved by joints: dual quaternions, twists, shoulders, normals.

May use: the skeleton, compiled loops.
"""
