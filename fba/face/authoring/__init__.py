"""Making a mesh and its feature points into a face that FAPs can move."""

from fba.face.authoring._author import author
from fba.face.authoring._shapes.morphs import from_morphs

__all__ = ["author", "from_morphs"]
