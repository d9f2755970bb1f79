"""Distances of users to actors, without and with a Persona, as in Tables 5.1 and 5.2 of the source.

A made-up actor is filmed for two minutes with every viseme, action unit and emotion, twice, and a Persona
is learnt. A user, another person without that style, performs them once more, and so does the actor. At the
strongest moment of each, masks are compared: K_U, the user's own, and K_P, played with the Persona, each
against K_A, the actor's.

python -m tools.persona.evaluation [--users 2] [--seed 1]
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from fba.arrays import Float64, Intp
from fba.choices import Means
from fba.cli.printing import print_table
from fba.persona import ClassRecogniser, Persona, learn, transfer
from fba.persona._observation import observe
from fba.persona._persona import MEANS
from fba.persona.points import mask_distance
from fba.persona.points.layout import PARTS, SAME, flat_mask, standard_mask
from fba.persona.recognition import decide, displacements
from tools.persona.actors import Act, Style, act, all_contents, contents, named_styles

TAUGHT = 2
"""Times that an actor performs every content for a Persona to be learnt."""
INTENSITY = 0.85
"""Intensity at which contents are compared."""
WITHIN = 4
"""Frames before and after the strongest one whose masks are averaged: the tracker's noise is not a style."""
OWN, FACE = "own", "face only"
"""The user without a Persona; the user's own motion on the actor's neutral face."""
KNOWN_USER = "motion, user known"
"""As "motion", with a Persona of the user, too."""
IN_STYLE = "user in that style"
"""The user who performs in the actor's style: as near as another person comes."""
WAYS = (FACE, IN_STYLE, KNOWN_USER, *MEANS)
ALIKE = (
    frozenset({"LFAU_26", "LFAU_27", "E_SURPRISE", "CAU_A26A12Lw"}),
    frozenset({"LFAU_23", "LFAU_34", "LFAU_24", "NEUTRAL"}),
    frozenset({"LFAU_22", "CAU_A22A25", "LFAU_18"}),
)
"""Classes that points can hardly tell apart: the source takes either of such a pair as right."""


@dataclass(frozen=True)
class Row:
    """Mean distances of one content, millimetres. own: H(K_U, K_A); played: way -> H(K_P, K_A)."""

    content: str
    own: float
    played: dict[str, float]

    def reduction(self, way: str) -> float:
        """Return the share by which the distance falls, 0 to 1."""
        return 1 - self.played[way] / self.own


@dataclass(frozen=True)
class Evaluation:
    """Results, by the names of `WAYS`.

    motion: rows for how masks have moved from their rest, on the standard mask: this is the style. faces:
    rows for masks as they are, as in the source, in which faces at rest count for most. agreement: share of
    parts whose class stays the user's. styles: style -> way -> mean reduction of `motion`, and of `faces`.
    consecutive: mean distance of an actor's masks in two frames, one after another. classes, masks: of the
    mouths of Personas, in the mean.
    """

    motion: tuple[Row, ...]
    faces: tuple[Row, ...]
    agreement: dict[str, float]
    styles: dict[str, dict[str, tuple[float, float]]]
    consecutive: float
    classes: float
    masks: float


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table: distances by content, then by how much they fall in the mean."""
    parser = argparse.ArgumentParser(prog="python -m tools.persona.evaluation", description=main.__doc__)
    parser.add_argument("--users", type=int, default=2, help="users for each actor (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of actors and users (default: %(default)s)")
    options = parser.parse_args(arguments)
    if options.users < 1 or options.seed < 0:
        parser.error("--users must be at least 1, and --seed at least 0")
    result = evaluate(users=options.users, seed=options.seed)
    rows = [
        [row.content, f"{row.own:.2f}", *(f"{row.played[way]:.2f}" for way in WAYS)] for row in result.motion
    ]
    for name, some in (("falls by", result.motion), ("with the rest", result.faces)):
        rows.append([name, "", *(f"{100 * mean_reduction(some, way):.1f} %" for way in WAYS)])
    agreement = (f"{100 * result.agreement[way]:.1f} %" if way in result.agreement else "" for way in WAYS)
    print_table(("without", *WAYS), [*rows, ["class kept", "", *agreement]], "content")
    print(f"masks of two consecutive frames of an actor: {result.consecutive:.2f} mm")


def mean_reduction(rows: Sequence[Row], way: str) -> float:
    """Return the mean over contents of the share by which the distance falls."""
    return float(np.mean([row.reduction(way) for row in rows]))


def evaluate(
    *,
    styles: dict[str, Style] | None = None,
    users: int = 2,
    seed: int = 1,
    names: Sequence[str] | None = None,
    recogniser: ClassRecogniser | None = None,
) -> Evaluation:
    """Return how near Personas bring users to actors of these styles, each with `users` users.

    names: of the contents that are performed; None for all.
    """
    performed = tuple(contents() if names is None else names)
    known = ClassRecogniser.default() if recogniser is None else recogniser
    chosen = named_styles() if styles is None else styles
    pairs = [
        _compare(style, performed, [seed, number, user], known)
        for number, style in enumerate(chosen.values())
        for user in range(users)
    ]
    groups = [pairs[first : first + users] for first in range(0, len(pairs), users)]
    by_style = {
        name: {
            way: (
                mean_reduction(_rows(performed, some, 1), way),
                mean_reduction(_rows(performed, some, 0), way),
            )
            for way in WAYS
        }
        for name, some in zip(chosen, groups, strict=True)
    }
    return Evaluation(
        _rows(performed, pairs, 1), _rows(performed, pairs, 0),
        {way: float(np.mean([one.agreement[way] for one in pairs])) for way in MEANS}, by_style,
        float(np.mean([one.consecutive for one in pairs])),
        float(np.mean([len(one.counts) for one in pairs])),
        float(np.mean([sum(one.counts) / max(len(one.counts), 1) for one in pairs])),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Pair:
    """One actor and one user. distances: way -> (2, N), of faces and of motion alone, at each content."""

    distances: dict[str, Float64]
    agreement: dict[str, float]
    consecutive: float
    counts: list[int]


def _compare(style: Style, names: tuple[str, ...], seed: list[int], known: ClassRecogniser) -> _Pair:
    """Return distances of one user to one actor."""
    random = np.random.default_rng(seed)
    actors, users = 1000 * seed[0] + seed[1], 1000 * seed[0] + 500 + 10 * seed[1] + seed[2]
    script = [(name, INTENSITY) for name in names]
    persona = learn(
        [act(all_contents(TAUGHT, random, names), style, seed=actors).face], "actor", recogniser=known
    )
    own_persona = learn([act(all_contents(TAUGHT, random, names), seed=users).face], "user", recogniser=known)
    shown = act(script, style, seed=actors)
    actor = observe(shown.face, known)
    all_moved = actor.mask_motion(known)
    near = mask_distance(standard_mask() + all_moved[:-1], standard_mask() + all_moved[1:])
    goal, at_rest = _hold(all_moved, actor.rows, shown), flat_mask(actor.neutral)
    performed = act(script, seed=users)
    seen = observe(performed.face, known)
    own = _hold(seen.mask_motion(known), seen.rows, performed)
    in_style = act(script, style, seed=users)
    same = observe(in_style.face, known)
    best = _hold(same.mask_motion(known), same.rows, in_style)
    distances = {
        OWN: _distances(own, flat_mask(seen.neutral), goal, at_rest),
        FACE: _distances(own, persona.neutral_mask, goal, at_rest),
        IN_STYLE: _distances(best, persona.neutral_mask, goal, at_rest),
    }
    agreement: dict[str, float] = {}
    for way in (*MEANS, KNOWN_USER):
        means: Means = "motion" if way == KNOWN_USER else cast("Means", way)
        user_known = own_persona if way == KNOWN_USER else None
        played = transfer(performed.face, persona, means=means, user=user_known, recogniser=known)
        acted = _hold(played.acted, played.rows, performed)
        distances[way] = _distances(acted, persona.neutral_mask, goal, at_rest)
        if way in MEANS:
            labels = {part: [played.labels[part][n] for n in _apex(played.rows, performed)] for part in PARTS}
            agreement[way] = _agreement(acted, persona, labels, known)
    counts = list(persona.parts["mouth"].count().values())
    return _Pair(distances, agreement, float(near.mean()), counts)


def _apex(rows: Intp, performed: Act) -> Intp:
    """Return where the strongest moments of a performance are among the frames that are used."""
    return np.searchsorted(rows, [frame for _, frame in performed.apex])


def _hold(moved: Float64, rows: Intp, performed: Act) -> Float64:
    """Return means of masks (S, 86, 3) over the frames in which each expression stays: (N, 86, 3)."""
    at = _apex(rows, performed)
    return np.asarray(np.mean([moved[at + step] for step in range(-WITHIN, WITHIN + 1)], axis=0))


def _distances(moved: Float64, face: Float64, goal: Float64, other: Float64) -> Float64:
    """Return distances (2, N) of masks that moved (N, 86, 3) from a neutral one (86, 3) to others: as they
    are, and of their motion alone."""
    standard = standard_mask()
    return np.stack([
        mask_distance(face + moved, other + goal), mask_distance(standard + moved, standard + goal),
    ])  # fmt: skip


def _rows(names: Sequence[str], pairs: Sequence[_Pair], which: int) -> tuple[Row, ...]:
    """Return rows of faces (0) or motion alone (1): means over actors and users."""
    table = {way: np.mean([one.distances[way][which] for one in pairs], axis=0) for way in (OWN, *WAYS)}
    return tuple(
        Row(name, float(table[OWN][n]), {way: float(table[way][n]) for way in WAYS})
        for n, name in enumerate(names)
    )


def _agreement(
    acted: Float64, persona: Persona, labels: dict[str, list[str]], known: ClassRecogniser
) -> float:
    """Return the share of parts at some moments whose class, recognised anew, is one of the user's."""
    points = np.repeat(persona.neutral[None], len(acted), axis=0)
    points[:, :SAME] += acted[:, :SAME, :2]
    right = []
    for part in PARTS:
        component = known.components[part]
        outputs = component.outputs(displacements(points, persona.neutral, part))
        shown = decide(outputs).names(component.classes)
        right += [_same(one, other) for one, other in zip(labels[part], shown, strict=True) if one]
    return float(np.mean(right))


def _same(one: str, other: str) -> bool:
    """Return whether two labels have a class in common, or a class that is hardly distinguishable."""
    here, there = set(one.split("/")), set(other.split("/"))
    return bool(here & there) or any(here & group and there & group for group in ALIKE)


if __name__ == "__main__":
    main()
