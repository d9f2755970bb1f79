"""What one picture shows, as plain data: meshes, lines, labels, the camera, the display switches.

May use: mesh. Knows no OpenGL.
"""
