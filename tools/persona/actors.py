"""Synthetic actors and users: different faces that perform a script, each in a given style."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache

import numpy as np

from fba.arrays import Bool, Float64
from fba.face import VISEME_NAMES, Definitions
from fba.parameters import FAP_COUNT, faps
from fba.persona import TrackedFace
from tools.persona.training.camera import photograph
from tools.persona.training.classes import class_faps, face_classes
from tools.persona.training.people import People, make_people, move_face

RATE = 30
REST = 1.2
"""Seconds at rest before a script begins."""
INTENSITIES = (0.4, 1.05)
RISE, HOLD, FALL, PAUSE = 0.3, 0.4, 0.3, 0.2
"""Seconds in which an expression comes, stays, goes, and until the next one begins."""
TURN = np.radians([3.0, 7.0, 3.0])
"""How far heads turn while they perform: pitch, yaw, roll."""


@dataclass(frozen=True)
class Style:
    """A way to move the face.

    mouth, eyes, brows: how strongly these move, 1 as usual. lopsided: how much stronger the left side is,
    -1 to 1 (the right side becomes weaker by as much). along: class -> (class, share): what comes along
    with it; "*" for any class. rise: how long expressions take to come and go, 1 as usual.
    """

    mouth: float = 1.0
    eyes: float = 1.0
    brows: float = 1.0
    lopsided: float = 0.0
    along: dict[str, tuple[str, float]] = field(default_factory=dict)
    rise: float = 1.0


def named_styles() -> dict[str, Style]:
    """Return styles by name: each of the four kinds, and two actors who have all of them."""
    with_smile = {"*": ("LFAU_12", 0.45), "LFAU_12": ("UFAU_2", 0.8), "E_HAPPY": ("LFAU_27", 0.25)}
    sadly = {"*": ("E_SADNESS", 0.6), "E_HAPPY": ("UFAU_4", 0.5)}
    gaily = {"*": ("E_HAPPY", 0.3), "LFAU_27": ("UFAU_2", 1.0)}
    return {
        "amplitude": Style(mouth=1.7, brows=1.8, eyes=1.15),
        "restraint": Style(mouth=0.5, brows=0.45, eyes=0.8),
        "asymmetry": Style(mouth=1.15, brows=1.1, lopsided=0.65),
        "co-activation": Style(along=with_smile),
        "timing": Style(mouth=1.35, brows=0.6, rise=2.2),
        "tragedian": Style(mouth=1.5, brows=1.7, lopsided=-0.4, along=sadly, rise=1.6),
        "comedian": Style(mouth=1.45, brows=1.5, lopsided=0.35, along=gaily, rise=0.7),
    }


@dataclass(frozen=True, eq=False)
class Act:
    """A performance whose truth is known.

    face: what a tracker sees. faps: float64 (T, 68). apex: (content, frame) of each expression at its
    strongest.
    """

    face: TrackedFace
    faps: Float64
    apex: tuple[tuple[str, int], ...]


@cache
def contents() -> dict[str, Float64]:
    """Return FAPs (68,) by content: the 34 classes that are not neutral, and the 14 visemes as "viseme 1"
    and so on."""
    known = {one.name: faps for one, faps in zip(face_classes(), class_faps(), strict=True) if one.recipe}
    visemes = Definitions.default().visemes
    return known | {viseme_name(n): visemes[n].astype(np.float64) for n in range(1, len(visemes))}


def viseme_name(number: int) -> str:
    """Return the name of a viseme in a script: "viseme 1 (p b m)"."""
    return f"viseme {number} ({VISEME_NAMES[number]})"


def act(
    script: Sequence[tuple[str, float]],
    style: Style | None = None,
    *,
    seed: int = 1,
    take: int | None = None,
    name: str = "",
    noise: float = 0.35,
) -> Act:
    """Return a performance of a script: (content, intensity) one after another, after a rest.

    style: None for the user's, who has no style but that of the face. seed: of the person and the film. take:
    another film of the same person; None for the one that the seed makes.
    """
    own = Style() if style is None else style
    people, person, random = _cast(seed, take)
    length = (RISE + FALL) * own.rise + HOLD + PAUSE
    count = int((REST + length * len(script) + 0.5) * RATE)
    times = np.arange(count) / RATE
    values, apex = np.zeros((count, FAP_COUNT)), []
    for number, (content, intensity) in enumerate(script):
        start = REST + number * length
        shape = _ease((times - start) / (RISE * own.rise))
        shape = shape * (1 - _ease((times - start - RISE * own.rise - HOLD) / (FALL * own.rise)))
        values += intensity * shape[:, None] * styled_faps(content, own)
        apex.append((content, round((start + RISE * own.rise + HOLD / 2) * RATE)))
    values *= people.gains[person]
    return Act(_film(people, person, values, times, Fraction(RATE), random, name, noise), values, tuple(apex))


def film_faps(
    values: Float64, rate: Fraction, *, seed: int = 1, take: int | None = None, name: str = "",
    noise: float = 0.35,
) -> TrackedFace:  # fmt: skip
    """Return what a tracker sees of a made-up person whose face shows FAPs (T, 68).

    Before them, the face rests for `REST` seconds. seed, take: as for `act`.
    """
    people, person, random = _cast(seed, take)
    shown = np.concatenate([np.zeros((round(REST * float(rate)), FAP_COUNT)), values])
    times = np.arange(len(shown)) / float(rate)
    return _film(people, person, shown, times, rate, random, name, noise)


def _cast(seed: int, take: int | None) -> tuple[People, int, np.random.Generator]:
    """Return people, which of them is filmed, and what the film's noise comes from."""
    random = np.random.default_rng(seed)
    people = make_people(2, random)
    person = int(random.integers(0, 2))
    return people, person, random if take is None else np.random.default_rng([seed, take])


def _film(
    people: People, person: int, values: Float64, times: Float64, rate: Fraction,
    random: np.random.Generator, name: str, noise: float,
) -> TrackedFace:  # fmt: skip
    """Return what a tracker sees of a person, whose head turns a little once the rest is over."""
    features = move_face(people, person, values)
    waves = np.stack(
        [np.sin(2 * np.pi * (random.uniform(0.1, 0.4) * times + random.uniform())) for _ in range(3)], axis=1
    )
    angles = TURN * waves * _ease((times - REST) / 0.5)[:, None]
    picture, turns = photograph(features, angles, random, noise=noise)
    return TrackedFace(picture, turns, np.ones(len(times), dtype=bool), times, rate, name)


def _ease(share: Float64) -> Float64:
    share = np.clip(share, 0, 1)
    return np.asarray(share * share * (3 - 2 * share))


def styled_faps(content: str, style: Style) -> Float64:
    """Return the FAPs (68,) of a content in a style, at full intensity."""
    values = contents()[content].copy()
    for when in ("*", content):
        added = style.along.get(when)
        if added is not None and added[0] != content:
            values = values + added[1] * contents()[added[0]]
    return values * style_gains(style)


def style_gains(style: Style) -> Float64:
    """Return how much a style makes of each FAP: (68,)."""
    gains = np.ones(FAP_COUNT)
    for fap in faps()[2:]:
        part = _part_of(fap.number)
        gains[fap.number - 1] = {"mouth": style.mouth, "eyes": style.eyes, "brows": style.brows}.get(
            part, 1.0
        )
        if part != "eyes":
            left, right = "_l_" in fap.name or "_lm" in fap.name, "_r_" in fap.name or "_rm" in fap.name
            gains[fap.number - 1] *= 1 + style.lopsided * (int(left) - int(right))
    return gains


@cache
def _groups() -> dict[str, Bool]:
    eyes = np.array([19 <= one.number <= 30 for one in faps()])
    brows = np.array([31 <= one.number <= 38 for one in faps()])
    mouth = np.array([one.number in (3, *range(4, 19), *range(51, 61)) for one in faps()])
    return {"mouth": mouth, "eyes": eyes, "brows": brows}


def _part_of(number: int) -> str:
    return next((name for name, group in _groups().items() if group[number - 1]), "")


def all_contents(
    repeats: int, random: np.random.Generator, names: Sequence[str] | None = None
) -> list[tuple[str, float]]:
    """Return a script with every content this often, in a random order, with random intensities.

    names: of the contents; None for all.
    """
    each = [name for name in (contents() if names is None else names) for _ in range(repeats)]
    return [(each[n], float(random.uniform(*INTENSITIES))) for n in random.permutation(len(each))]
