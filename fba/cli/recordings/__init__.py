"""Recordings of one moment in one stream: a face, a body, a voice.

May use: the rest of the command line but for its commands.
"""
