"""Persona: an actor's way of moving the face, learnt from tracked points, for another person's performance.

    persona = fba.persona.learn([actor])  # actor: a TrackedFace, for example from `from_point_motion`
    animation = fba.persona.animate_as(user, persona)  # FAPs, which move any face

May use: points and recognition of a Persona, formats, and the modules of `fba` itself.
"""

from fba.persona._learning import learn
from fba.persona._live import LivePersona
from fba.persona._performance import Performance, animate_as, transfer
from fba.persona._persona import PartStyle, Persona
from fba.persona._recordings import read_recording, write_recording
from fba.persona.points import TrackedFace, from_point_motion
from fba.persona.recognition import ClassRecogniser

__all__ = [
    "ClassRecogniser", "LivePersona", "PartStyle", "Performance", "Persona", "TrackedFace", "animate_as",
    "from_point_motion", "learn", "read_recording", "transfer", "write_recording",
]  # fmt: skip
