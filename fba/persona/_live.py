"""`LivePersona`: a user's face in an actor's style, frame by frame."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64
from fba.choices import Means
from fba.errors import ModelError
from fba.parameters import FAP_COUNT
from fba.persona._observation import NEUTRAL_FRAMES
from fba.persona._performance import DEFAULT_MEANS, HEAD, MAPPED, choose_masks, usable_means, user_maps
from fba.persona._persona import Persona
from fba.persona._restyle import Follower, keep_shut
from fba.persona.motion import flatten, unflatten
from fba.persona.points._tracked import MAX_MISFIT, MAX_TURN, register_points
from fba.persona.points.layout import PARTS, TRACKED, VERTICES, flat_mask, part_vertices
from fba.persona.recognition import ClassRecogniser, decide
from fba.persona.recognition._faps import face_scale, mask_faps, measure_fapu
from fba.persona.recognition._recogniser import displacements


class LivePersona:
    """Converts each frame of a user to FAPs in an actor's style.

    rate: frames per second. Other options as for `perform`. With "motion", the actor's amplitude and sides
    are applied as the user's habits become known, or from the start with `user`; speeds stay the user's.

    The first 30 usable frames give the user's neutral face. A frame without a face, with a head turned too
    far, or of a class that the actor lacks, repeats the frame before it.
    """

    def __init__(
        self,
        persona: Persona,
        *,
        means: Means = DEFAULT_MEANS,
        user: Persona | None = None,
        rate: float = 30.0,
        recogniser: ClassRecogniser | None = None,
    ) -> None:
        self._persona, self._means = persona, usable_means(persona, means)
        self._recogniser = ClassRecogniser.default() if recogniser is None else recogniser
        self._maps = user_maps(persona, self._recogniser, user) if self._means in MAPPED else {}
        self._followers: dict[str, Follower] = {}
        if self._means == "motion":
            usual = None if user is None else user.motions
            for part, motion in (persona.motions or {}).items():
                reach = persona.parts[part].reach(face_scale(persona.fapu, part))
                self._followers[part] = Follower(motion, reach, None if usual is None else usual[part], rate)
        self._frame = -1
        self._first: list[Float64] = []
        self._neutral: Float64 | None = None
        self._fapu = persona.fapu
        self._moved = np.zeros((VERTICES, 3))
        self._faps = np.zeros(FAP_COUNT)

    @property
    def ready(self) -> bool:
        """Whether the user's neutral face is known."""
        return self._neutral is not None

    def push(self, points: npt.ArrayLike, angles: npt.ArrayLike, tracked: bool = True) -> Float64 | None:
        """Return the FAPs (68,) of this frame; None until the user's neutral face is known.

        points: (64, 2), as in `TrackedFace`. angles: (3,), radians. Raises ModelError for other shapes.
        """
        self._frame += 1
        seen, turns = np.asarray(points, dtype=np.float64), np.asarray(angles, dtype=np.float64)
        if seen.shape != (TRACKED, 2) or turns.shape != (3,):
            raise ModelError(
                f"a frame has points (64, 2) and angles (3,), not {seen.shape} and {turns.shape}"
            )
        usable = tracked and bool(np.isfinite(seen).all() and np.isfinite(turns).all())
        if usable and bool((np.abs(turns[:2]) <= MAX_TURN).all()):
            registered, misfit = register_points(seen[None], turns[1:2])
            if misfit[0] <= MAX_MISFIT:
                self._take(registered, turns)
        return self._faps.copy() if self.ready else None

    def _take(self, points: Float64, angles: Float64) -> None:
        """Take registered points (1, 64, 2)."""
        if self._neutral is None:
            self._first.append(points[0])
            if len(self._first) == NEUTRAL_FRAMES:
                self._neutral = np.median(self._first, axis=0)
                self._fapu = measure_fapu(self._neutral)
            return
        own = flat_mask(points) - flat_mask(self._neutral)
        for part in PARTS:
            component = self._recogniser.components[part]
            scores = component.scores(displacements(points, self._neutral, part))
            labels = decide(component.network(scores))
            if part == "mouth":
                own[..., 2] = self._recogniser.find_depth(scores, labels.first)
            rows = part_vertices(part)
            there = face_scale(self._persona.fapu, part)
            even = own / np.append(face_scale(self._fapu, part), 1.0)
            if self._means in MAPPED:
                flat = flatten(even[:, rows, :2])
                moved = self._maps[part](flat)
                if part in self._followers:
                    label = int(labels.first[0])
                    moved[0] = self._followers[part].push(flat[0], moved[0], label, self._frame)
                self._moved[rows, :2] = there * unflatten(moved)[0]
                continue
            style = self._persona.parts[part]
            chosen = int(choose_masks(style, part, even, there, labels, component.classes)[0])
            if chosen >= 0:
                self._moved[rows] = style.moved[chosen]
        if self._means in MAPPED:
            self._moved[:, 2] = own[0, :, 2]
        if self._followers:
            keep_shut(self._moved[None], own, self._persona.neutral, self._neutral)
        self._faps = mask_faps(self._moved[None], self._persona.fapu, self._recogniser.jaw)[0]
        self._faps[[fap - 1 for fap in HEAD]] = angles / 1e-5
