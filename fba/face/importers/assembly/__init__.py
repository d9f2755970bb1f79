"""Pieces of an imported mesh put together to a face model: kinds of parts, units, landmarks, materials."""
