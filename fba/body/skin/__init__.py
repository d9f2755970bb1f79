"""Skinning, vertices moved by joints: dual quaternions, twists, shoulders, normals."""
