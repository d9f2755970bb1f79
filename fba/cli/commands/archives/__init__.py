"""Subcommands over many performances: archive, find."""
