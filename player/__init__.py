"""The folder of the package `fba_player`; `player` was its name, which could be anyone's."""

raise ImportError(
    "the package 'player' is now called 'fba.player': from fba.player import ...", name="player"
)
