"""Tables of marker positions in text: TRC, Motive, Nexus and Qualisys exports, plain tables.

May use: capture.
"""
