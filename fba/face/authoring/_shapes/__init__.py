"""Morph shapes of other programs turned into tables for FAPs."""
