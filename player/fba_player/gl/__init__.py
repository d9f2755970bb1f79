"""Views drawn with OpenGL 3.3: context, programs, renderers, shadows, edges.

May use: view, figure, mesh. `shaders/` holds the GLSL.
"""
