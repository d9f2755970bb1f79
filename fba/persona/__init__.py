"""Persona: an actor's way of moving the face, learnt from tracked points, for another person's performance.

    persona = fba.persona.learn([actor])  # actor: a TrackedFace, for example from `from_point_motion`
    animation = fba.persona.play(user, persona)  # FAPs, which move any face

May use: points and recognition of a Persona, formats, and the modules of `fba` itself.
"""

from fba.persona._learning import learn
from fba.persona._live import LivePersona
from fba.persona._performance import Performance, perform, play
from fba.persona._persona import PartStyle, Persona
from fba.persona._recordings import read_recording, write_recording
from fba.persona._storage import load_persona, save_persona
from fba.persona.points import TrackedFace, from_point_motion
from fba.persona.recognition import Recogniser

__all__ = [
    "LivePersona",
    "PartStyle",
    "Performance",
    "Persona",
    "Recogniser",
    "TrackedFace",
    "from_point_motion",
    "learn",
    "load_persona",
    "perform",
    "play",
    "read_recording",
    "save_persona",
    "write_recording",
]
