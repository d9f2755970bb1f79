"""Recognition of expressions: displaced points of each part, principal components, small networks, classes.

May use: the points of a Persona, and readers of arrays.
"""

from fba.persona.recognition._component import Component, Network, displacements
from fba.persona.recognition._recogniser import ClassRecogniser, Labels, decide

__all__ = ["ClassRecogniser", "Component", "Labels", "Network", "decide", "displacements"]
