"""Faces and bodies deformed on the graphics card, with what OpenGL 3.3 has for it: tables as textures, places
drawn into a texture, and from there positions and normals by transform feedback into the buffers that are
drawn. The formulas are those of `fba.face.deform._loops` and `fba.body.skin.loops`.
"""
