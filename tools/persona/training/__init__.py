"""Training of the recogniser of expressions, with synthetic faces or a database in the layout of Bosphorus.

May use: points and recognition of a Persona, captured action units, the face.
`python -m tools.persona.training -o FILE` makes the trained default again.
"""
