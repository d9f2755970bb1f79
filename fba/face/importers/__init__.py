"""Faces made by others: MakeHuman, FDP files, OBJ and PLY meshes, glTF heads with morph targets."""

from __future__ import annotations
