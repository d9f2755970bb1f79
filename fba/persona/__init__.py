"""Persona: how an actor moves the face, learnt from tracked points, and another person's performance in that
style.

::

    persona = fba.persona.learn([actor])  # actor: a TrackedFace, from `from_point_motion` or `read_recording`
    animation = fba.persona.animate_as(user, persona)  # FAPs, which move any face

May use: points and recognition of a Persona, formats, and the modules of `fba` itself.
"""

from fba.persona.learning import learn
from fba.persona.live import LivePersona
from fba.persona.performance import Performance, animate_as, transfer
from fba.persona.persona import PartStyle, Persona
from fba.persona.points import TrackedFace, from_point_motion
from fba.persona.recognition import ClassRecogniser
from fba.persona.recordings import read_recording, write_recording

__all__ = [
    "ClassRecogniser",
    "LivePersona",
    "PartStyle",
    "Performance",
    "Persona",
    "TrackedFace",
    "animate_as",
    "from_point_motion",
    "learn",
    "read_recording",
    "transfer",
    "write_recording",
]
