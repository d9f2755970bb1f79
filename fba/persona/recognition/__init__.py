"""What a face does: displaced points of each part, principal components, small networks, classes.

May use: the points of a Persona, and what reads arrays of numbers.
"""

from fba.persona.recognition._component import Component
from fba.persona.recognition._network import Network, train
from fba.persona.recognition._recogniser import Labels, Recogniser, decide

__all__ = ["Component", "Labels", "Network", "Recogniser", "decide", "train"]
