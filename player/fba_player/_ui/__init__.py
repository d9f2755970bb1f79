"""The panels and controls over the picture, made with Dear ImGui; drawn in a window or into memory.

May use: session, gl, scene. `gui` draws the state of a session; each panel is a class in `panels`. imgui is
imported only when a window opens.
"""
