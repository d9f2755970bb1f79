"""C3D: positions of markers in, from binary files of any maker.

May use: capture.
"""
