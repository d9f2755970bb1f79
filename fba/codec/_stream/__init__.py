"""A stream while it is decoded: its bytes, the times of its planes, its objects and their marks, its damage.

May use: settings, errors, and the names of start codes. Knows nothing of what planes carry.
"""
