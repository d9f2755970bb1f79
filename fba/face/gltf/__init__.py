"""Face models as glTF 2.0: ordinary meshes with morph targets, and the extension FBA_face."""
