"""Tells moods by how faces move: `python -m tools.persona.blind_test [--real FOLDER]`.

Each of three moods has takes of one person; a Persona is learnt from some, and whose the others are is told
blindly, with the mean of each take removed: by masks alone, and by the statistics of motion that a Persona
stores. Then other persons, who have none of these moods, are played with each Persona, filmed anew on a face
that belongs to nobody else, and told in the same way. Chance is a third.

Without options, the performances are synthetic: three styles of one actor. With --real, they are FAPs of a
folder, by name: angry_*, genial_* (gnial_*) and thinking_*, of which one take at a time is held out, and
yes_*, four of which follow one another, for the persons without a mood. They are filmed on made-up faces.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

import fba
from fba.arrays import Float64
from fba.choices import Means
from fba.parameters import FAP_COUNT
from fba.persona import ClassRecogniser, Persona, TrackedFace, animate_as, learn
from fba.persona._observation import Observation, observe
from fba.persona.motion import Motion, flatten, measure_motion
from fba.persona.points import mask_distance
from fba.persona.points.layout import PARTS, part_points, part_vertices, standard_mask
from fba.persona.recognition._faps import face_scale, measure_fapu
from tools.persona.actors import INTENSITIES, Style, act, contents, film_faps

MOODS = {
    "lively": Style(mouth=1.25, brows=1.4, rise=0.75),
    "weary": Style(mouth=0.8, brows=0.7, eyes=0.85, rise=1.5),
    "wry": Style(lopsided=0.35),
}
"""Made-up moods: amplitude and speed of one kind, of the other, and one side."""
ACTOR, USERS, SCREEN = 11, (77, 78), 500
"""Seeds of the actor, of the users, and of the face on which performances are filmed anew."""
TAKES, LEARNT, USER_TAKES = 10, 5, 6
JOINED = 4
"""Files of a person without a mood that make a performance."""
SHOWN = 24
"""Contents, of 48, that a take has: half of them, so that no two takes have the same."""
REAL = {"angry": ("angry_",), "genial": ("genial_", "gnial_"), "thinking": ("thinking_",)}
WEIGHT = 0.5
"""Of classes against all frames, where they were seen long enough."""
ENOUGH = 1.0
"""Seconds of a class that count by half."""
MEANS: tuple[Means, ...] = ("masks", "curves", "motion")
EVERY = 4
"""Frames from one that masks are compared with to the next."""


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--real", type=Path, metavar="FOLDER", help="folder with FAP files of moods")
    folder = parser.parse_args().real
    warnings.simplefilter("ignore")
    rows = made_up() if folder is None else real(folder)
    print("| films | number | masks alone | statistics of motion |\n|---|---|---|---|")
    for name, number, masks, motion in rows:
        print(f"| {name} | {number} | {100 * masks:.0f} % | {100 * motion:.0f} % |")


def made_up(
    takes: int = TAKES, learnt: int = LEARNT, user_takes: int = USER_TAKES, means: Sequence[Means] = MEANS
) -> list[Row]:
    """Return rows of the table for made-up moods."""
    filmed = {
        mood: [
            act(script([number, take]), style, seed=ACTOR, take=100 * number + take).face
            for take in range(takes)
        ]
        for number, (mood, style) in enumerate(MOODS.items())
    }
    personas = {mood: learn(faces[:learnt], mood) for mood, faces in filmed.items()}
    held_out = [(mood, face) for mood, faces in filmed.items() for face in faces[learnt:]]
    users = [
        act(script([9, seed, take]), seed=seed, take=take).face
        for seed in USERS
        for take in range(user_takes)
    ]
    return [count("the actor's, held out", held_out, personas), *count_played(users, personas, means)]


def real(folder: Path) -> list[Row]:
    """Return rows of the table for FAPs of a folder; one take of each mood is held out at a time."""
    filmed = {
        mood: [film_files([path], ACTOR) for begin in begins for path in sorted(folder.glob(f"{begin}*.fap"))]
        for mood, begins in REAL.items()
    }
    found = []
    for mood, faces in filmed.items():
        for n, face in enumerate(faces):
            personas = {
                one: learn([take for k, take in enumerate(some) if (one, k) != (mood, n)], one)
                for one, some in filmed.items()
            }
            found.append(compare(mood, face, personas))
    personas = {mood: learn(faces, mood) for mood, faces in filmed.items()}
    paths = sorted(folder.glob("yes_*.fap"))
    users = [film_files(paths[n : n + JOINED], USERS[0]) for n in range(0, len(paths), JOINED)]
    return [share("the actor's, one held out at a time", found), *count_played(users, personas)]


Row = tuple[str, int, float, float]


def script(seed: Sequence[int]) -> list[tuple[str, float]]:
    """Return some contents at random intensities."""
    random, names = np.random.default_rng(list(seed)), list(contents())
    chosen = random.choice(len(names), SHOWN, replace=False)
    return [(names[n], float(random.uniform(*INTENSITIES))) for n in chosen]


def film_files(paths: Sequence[Path], seed: int) -> TrackedFace:
    """Return a film of a made-up person who performs the FAPs of files, with half a second between them."""
    shown, rate = np.zeros((0, FAP_COUNT)), Fraction(1)
    for path in paths:
        animation = fba.read(path)
        assert animation.face is not None
        values, rate = animation.face.values.astype(np.float64), animation.rate
        if len(shown):
            share = np.linspace(0, 1, int(rate / 2))[:, None]
            shown = np.concatenate([shown, shown[-1] * (1 - share) + values[0] * share])
        shown = np.concatenate([shown, values])
    return film_faps(shown, rate, seed=seed, take=sum(paths[0].stem.encode()))


def count_played(
    users: Sequence[TrackedFace], personas: dict[str, Persona], means: Sequence[Means] = MEANS
) -> list[Row]:
    """Return a row for each of `means`: users in each mood, by its Persona."""
    return [
        count(f"other persons', played by `{one}`", performed(users, personas, one), personas)
        for one in means
    ]


def performed(
    users: Sequence[TrackedFace], personas: dict[str, Persona], means: Means
) -> list[tuple[str, TrackedFace]]:
    """Return films of a face on which each user is played with each Persona."""
    films = []
    for mood, persona in personas.items():
        for number, user in enumerate(users):
            animation = animate_as(user, persona, means=means, head=False)
            assert animation.face is not None
            values = animation.face.values.astype(np.float64)
            films.append((mood, film_faps(values, Fraction(animation.rate), seed=SCREEN, take=number)))
    return films


@dataclass(frozen=True)
class Found:
    """How far a film of a mood is from each mood: by masks and by the statistics of motion."""

    mood: str
    masks: dict[str, float]
    motion: dict[str, float]


def count(name: str, films: Sequence[tuple[str, TrackedFace]], personas: dict[str, Persona]) -> Row:
    """Return a row: number of films, and the shares recognised by masks and by motion."""
    return share(name, [compare(mood, face, personas) for mood, face in films])


def share(name: str, found: Sequence[Found]) -> Row:
    """Return a row of the results for each film.

    A Persona with more masks is nearer to every film. So a distance from masks counts against its mean over
    all films (geometric), which favours masks: of one film alone this mean is not known.
    """
    usual = {mood: np.mean([np.log(one.masks[mood]) for one in found]) for mood in found[0].masks}
    masks = [min(usual, key=lambda mood: np.log(one.masks[mood]) - usual[mood]) == one.mood for one in found]
    motion = [min(one.motion, key=one.motion.__getitem__) == one.mood for one in found]
    return name, len(found), float(np.mean(masks)), float(np.mean(motion))


def compare(mood: str, face: TrackedFace, personas: dict[str, Persona]) -> Found:
    """Return how far a film of a mood is from each Persona."""
    seen, moved = look(face)
    take = measure(seen, moved, float(face.rate))
    return Found(
        mood,
        {name: distance_of_masks(seen, moved, persona) for name, persona in personas.items()},
        {name: distance_of_motion(take, persona.motions or {}) for name, persona in personas.items()},
    )


def look(face: TrackedFace) -> tuple[Observation, dict[str, Float64]]:
    """Return the observation of a face, and displacements (S, V, 2) of each part on the standard face."""
    seen = observe(face, ClassRecogniser.default())
    moved, fapu = seen.mask_motion(ClassRecogniser.default()), measure_fapu(seen.neutral)
    return seen, {part: moved[:, part_vertices(part), :2] / face_scale(fapu, part) for part in PARTS}


def measure(seen: Observation, moved: dict[str, Float64], rate: float) -> dict[str, Motion]:
    """Return the statistics of a film's motion. They are about means: those do not count."""
    known = ClassRecogniser.default().components
    return {
        part: measure_motion(
            flatten(moved[part]), seen.labels[part].first, seen.rows, rate, len(known[part].classes)
        )
        for part in PARTS
    }


def distance_of_motion(take: dict[str, Motion], mood: dict[str, Motion]) -> float:
    """Return how far statistics of motion are apart: squares of logarithms, summed over parts."""
    total = 0.0
    for part, one in take.items():
        other = mood[part]
        apart = ((one.spread - other.spread) ** 2).mean(axis=1) + (one.speed - other.speed) ** 2
        seen = np.minimum(one.seconds, other.seconds)[:-1]
        weights = seen / (seen + ENOUGH) * one.seconds[:-1] / max(one.seconds[-1], 1e-9)
        total += float(apart[-1] + WEIGHT * (weights @ apart[:-1]))
    return total


def distance_of_masks(seen: Observation, moved: dict[str, Float64], persona: Persona) -> float:
    """Return how far a film's masks are from a Persona's nearest of their class, each less their mean."""
    apart = []
    for part in PARTS:
        rows, style = part_points(part), persona.parts[part]
        still, masks = standard_mask()[rows, :2], style.moved[:, : len(rows), :2]
        masks, frames = masks / face_scale(persona.fapu, part), moved[part][:, : len(rows)]
        masks, frames = masks - masks.mean(axis=0), frames - frames.mean(axis=0)
        names = seen.labels[part].names(ClassRecogniser.default().components[part].classes)
        for n in range(0, len(frames), EVERY):
            known = style.rows.get(names[n], style.rows.get(names[n].partition("/")[0]))
            if names[n] and known is not None:
                apart.append(mask_distance(still + frames[n], still + masks[known]).min())
    return float(np.mean(apart))


if __name__ == "__main__":
    main()
