"""FAP and BAP text files.

May use: parameters and the data model.
"""
