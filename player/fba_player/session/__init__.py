"""What is open, chosen and asked for in a window: files, keys, actions, the camera, takes by hand.

May use: scene, playback, sound, export. Knows no window and no imgui.
"""
