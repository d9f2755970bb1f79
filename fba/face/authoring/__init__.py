"""Making a mesh and its feature points into a face that FAPs can move."""

from fba.face.authoring.author import author
from fba.face.authoring.shapes.morphs import add_shapes

__all__ = ["add_shapes", "author"]
