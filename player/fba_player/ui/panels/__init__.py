"""The panels, one module each, and the curves and lists that they are made of.

May use: session, scene, playback.
"""
