"""Readers of datagrams, one for each protocol.

May use: the readers in `fba.formats` of files with the same content.
"""
