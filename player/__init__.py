"""Former name of the package `fba_player`, which is in this folder; importing it raises ImportError."""

raise ImportError(
    "the package 'player' is now called 'fba.player': from fba.player import ...", name="player"
)
