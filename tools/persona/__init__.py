"""Training of what recognises expressions, and how near a Persona brings a user to an actor.

May use: all of a Persona. `python -m tools.persona.training`, `.evaluation` and `.blind_test` are commands.
"""
