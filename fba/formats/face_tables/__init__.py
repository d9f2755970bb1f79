"""Tables and records of captured faces, with a row or a record for each moment.

May use: what formats share, and `fba.capture`.
"""
