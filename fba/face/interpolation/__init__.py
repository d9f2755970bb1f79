"""The FAP interpolation table (FIT): values that a stream leaves out, computed from those it sends.

May use: parameters. Knows no model and no stream.
"""
