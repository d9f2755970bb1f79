"""The panels, one module each, with the curves and lists that they share.

May use: session, scene, playback.
"""
