"""Timelines, the transport that plays them, and streams that are still arriving.

May use: `fba` and `fba.codec`. Draws nothing.
"""
