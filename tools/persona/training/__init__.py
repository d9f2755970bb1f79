"""Training of what recognises expressions: faces that are made up, or a database in the layout of Bosphorus.

May use: points and recognition of a Persona, captured action units, the face.
`python -m tools.persona.training -o FILE` makes the trained default again.
"""
