"""Captures of faces whose truth is known, in every format that is read: how much of the FAPs comes back?

`python -m tools.captures write FOLDER` writes them beside the FAPs that were performed, to try any
program with; `measure` encodes them and prints how far the FAPs are off, by head and by kind of capture.
May use: `fba` without the command line.
"""
