"""The player's built-in head."""

from player.head.head import Head

__all__ = ["Head"]
