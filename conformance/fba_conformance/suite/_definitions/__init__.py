"""Definitions of the test vectors: which planes, with which values, and which damage.

May use: the stream writer, the second decoder, parameters.
"""
