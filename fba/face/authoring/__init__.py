"""Making a mesh and its feature points into a face that FAPs can move."""

from fba.face.authoring.author import author

__all__ = ["author"]
