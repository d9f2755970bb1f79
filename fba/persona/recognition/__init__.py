"""Recognition of expressions: displaced points of each part, principal components, small networks, classes.

May use: the points of a Persona, and readers of arrays.
"""

from fba.persona.recognition._recogniser import (
    ClassRecogniser,
    Component,
    Labels,
    Network,
    decide,
    displacements,
)

__all__ = ["ClassRecogniser", "Component", "Labels", "Network", "decide", "displacements"]
