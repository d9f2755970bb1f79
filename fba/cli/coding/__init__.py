"""Streams that commands write: options about their size and captures, and reports.

May use: the rest of the command line but for its commands.
"""
