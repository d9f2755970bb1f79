"""Pictures and films without a window: PNG, MP4, GIF, contact sheets, notebooks, pyrender.

May use: gl, scene, sound.
"""
