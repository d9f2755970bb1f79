"""Faces and bodies for the web: models packed for the player in JavaScript."""

from fba_player.web._packing import pack_body, pack_face

__all__ = ["pack_body", "pack_face"]
