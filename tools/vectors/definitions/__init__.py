"""Definitions of the test vectors: which planes, with which values, and which damage."""
