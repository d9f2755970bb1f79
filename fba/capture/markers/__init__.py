"""Markers on a face to FAPs: gaps filled, head motion removed, displacements solved for FAPs.

May use: parameters, the face, and the modules of `fba` itself.
"""
