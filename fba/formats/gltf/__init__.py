"""glTF 2.0 as a format of animations: skeletons and faces in, a skinned person out.

May use: `fba.gltf`, face, body, capture.
"""
