"""Vertices carried by joints: dual quaternions, twists, shoulders, moving normals.

May use: the skeleton, compiled loops.
"""
