"""What is shown at a time: an animation on a figure, several compared, and how it is framed.

May use: figure, playback, view. Knows no OpenGL.
"""
