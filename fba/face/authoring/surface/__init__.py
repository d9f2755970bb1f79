"""The surface that regions move: neighbours, weights, landmarks, and limits where it would fold.

May use: the face model, meshes.
"""
