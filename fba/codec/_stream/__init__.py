"""A stream while it is decoded: its bytes, the times of its planes, and its damage.

May use: settings and errors. Knows nothing of what planes carry.
"""
