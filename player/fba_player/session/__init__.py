"""The state of a window: the open file, keys and actions, the camera, screenshots, films, recorded takes.

May use: scene, playback, sound, export. Knows no window and no imgui.
"""
