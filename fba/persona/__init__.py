"""Persona: an actor's way of moving the face, learnt from tracked points, for another person's performance.

    persona = fba.persona.learn([actor])  # actor: a TrackedFace, for example from `from_point_motion`
    animation = fba.persona.play(user, persona)  # FAPs, which move any face

May use: points and recognition of a Persona, formats, and the modules of `fba` itself.
"""

from fba.persona.learning import learn
from fba.persona.live import LivePersona
from fba.persona.performance import Performance, perform, play
from fba.persona.persona import PartStyle, Persona
from fba.persona.points import TrackedFace, from_point_motion
from fba.persona.recognition import Recogniser
from fba.persona.recordings import read_recording, write_recording
from fba.persona.storage import load_persona, save_persona

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
