"""FBA streams in other containers and on the wire, as pure bytes: no sockets, no files, no clock.

May use: codec, serving and the data model.
"""
