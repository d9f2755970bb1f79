"""Show what a live capture says now, in place of the stream's last frame, which comes later."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fba.arrays import Float32, Float64
from fba.face.resolve import Resolver
from fba.tracks import BodyTrack, FaceTrack
from fba_player.scene.scene import Scene
from fba_player.session.session import Session

Newest = Callable[[], tuple[FaceTrack | None, BodyTrack | None]]
"""Returns tracks of one frame: the face and the body now; None for what is not there."""
FOLLOWED = 1.0
"""Seconds from the end of what has arrived within which a picture shows the newest values."""


def follow_newest(session: Session, newest: Newest) -> None:
    """Let pictures show the newest values while the stream arrives and is played at its end.

    Who pauses, or seeks back, sees the stream instead; playing on, or the last frame, leads back.
    """
    scene = session.scene
    settings = scene.model if isinstance(scene, Scene) else None

    def show(faps: Float32, baps: Float64) -> None:
        transport = session.transport
        if not scene.timeline.growing:
            session.rolling.discard("newest")
            return
        if not transport.playing or transport.behind > FOLLOWED:
            return
        face, body = newest()
        if face is not None:
            faps[:] = Resolver(settings).push(face)[0]
        if body is not None:
            np.copyto(baps, body.values[0], where=body.mask[0])

    session.before_frame.append(show)
    session.rolling.add("newest")
