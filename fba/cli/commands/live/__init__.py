"""Subcommands that send and receive while it happens: capture, send, serve."""
