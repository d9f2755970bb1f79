"""The window: glfw for window and input, moderngl for the picture, imgui for the panels.

May use: everything in the player.
"""
