"""FBA streams in other containers and on the wire, as pure bytes: no sockets, no files, no clock.

May use: codec, serving and the data model. Files are opened in `fba.formats`, sockets in `fba.live`, sound is
coded in `fba_player.sound`.
"""
