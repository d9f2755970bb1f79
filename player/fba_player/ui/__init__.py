"""The player's panels over the picture, made with Dear ImGui; drawn in the window or into memory.

`session` holds what is shown and chosen, `gui` draws it; each panel is a small class in a file of its own,
listed in `panels`. Only `gui` and what it draws import imgui, and only once a window opens.
"""
