"""Making a mesh and its feature points into a face that FAPs can move."""

from fba.face.authoring._author import author
from fba.face.authoring._shapes.morphs import add_shapes

__all__ = ["add_shapes", "author"]
