"""The player: animations in a window, as pictures and films. `fba.player` has its public names."""
