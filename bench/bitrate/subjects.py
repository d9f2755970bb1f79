"""Subjects: the faces and the bodies that are coded, each by itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fba.animation import Animation
from fba.errors import OptionError
from fba.parameters import BAP_STEPS_DEFAULT, BapTable

FACE, BODY = "face", "body"


@dataclass(frozen=True, eq=False)
class Subject:
    """One face or one body, of which at least one low-level FAP or BAP moves.

    name: of the file. kind: "face" or "body". animation: that part alone. bap_steps: the table of its steps.
    """

    name: str
    kind: str
    animation: Animation
    bap_steps: BapTable = BAP_STEPS_DEFAULT

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return float(self.animation.duration)


def split_subjects(name: str, animation: Animation, bap_steps: BapTable) -> list[Subject]:
    """Return the face and the body of an animation, as far as they move; an empty list where neither does.

    Visemes and expressions alone do not count: they take a few bits a second in any form.
    OptionError for an animation without frames.
    """
    if not len(animation):
        raise OptionError(f"{name} has no frames; a bit rate needs at least one")
    animation = replace(animation, index=animation.index - animation.index[0])  # no time codes
    subjects = []
    if animation.face is not None and animation.face.values.any():
        subjects.append(Subject(name, FACE, replace(animation, body=None), bap_steps))
    if animation.body is not None and animation.body.values.any():
        subjects.append(Subject(name, BODY, replace(animation, face=None), bap_steps))
    return subjects
