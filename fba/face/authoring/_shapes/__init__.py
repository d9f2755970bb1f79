"""Morph shapes of other programs turned into tables for FAPs.

May use: authoring and the face model.
"""
