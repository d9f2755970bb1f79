"""How animations travel, as bytes: no files and no sockets here.

May use: codec and the data model.
"""
