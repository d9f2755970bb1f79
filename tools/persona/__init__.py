"""Training of the recogniser of expressions, and evaluation of Personas.

May use: all of a Persona. `python -m tools.persona.training`, `.evaluation` and `.blind_test` are commands.
"""
