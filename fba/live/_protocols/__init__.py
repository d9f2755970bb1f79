"""Readers of datagrams, one for each protocol.

May use: the readers of files of the same content in `fba.formats`.
"""
