"""Streams that commands write: how small, from what, and what is said of them.

May use: the rest of the command line but for its commands.
"""
