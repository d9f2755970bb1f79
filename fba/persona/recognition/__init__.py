"""What a face does: displaced points of each part, principal components, small networks, classes.

May use: the points of a Persona, and what reads arrays of numbers.
"""

from fba.persona.recognition.component import Component
from fba.persona.recognition.network import Network, train
from fba.persona.recognition.recogniser import ClassRecogniser, Labels, decide

__all__ = ["ClassRecogniser", "Component", "Labels", "Network", "decide", "train"]
