"""Time: timelines, the transport that plays them, streams that still arrive.

May use: `fba` and `fba.codec`. Knows no picture.
"""
