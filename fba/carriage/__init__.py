"""FBA streams inside other transports and files, as pure bytes: no files, no sockets.

May use: codec and the data model. Files are opened in `fba.formats`, sound is coded in `fba_player.sound`.
"""
