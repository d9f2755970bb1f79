"""Streams with bodies of many kinds, made with either table of BAP steps, to try how the table is chosen.

`python tests/helpers/made_streams.py 500` makes that many, and prints how often the choice is right with the
mark and without it.
"""

import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.resources import as_file, files

import numpy as np

import fba
from fba import Animation, BodyTrack, EncoderOptions
from fba.body import gait
from fba.codec import encode_animation
from fba.formats.step_choice import UNSURE, choose_steps
from fba.parameters import BapTable, bap_numbers

KINDS = ("walk", "capture", "gesture", "idle", "keyed", "seated", "jump", "turn")
RATES = (10, 12, 15, 24, 25, 30, 50, 60)
ARMS = ("shoulder_flexion", "shoulder_abduct", "shoulder_twisting", "elbow_flexion", "wrist_flexion")
ROOT = [bap_numbers()[f"HumanoidRoot_tr_{way}"] - 1 for way in ("vertical", "lateral", "frontal")]
TURN = bap_numbers()["HumanoidRoot_rt_body_turn"] - 1


@dataclass(frozen=True)
class Made:
    """A stream. kind: of its motion. table: with which it was made. unmarked, marked: its bytes."""

    kind: str
    table: BapTable
    unmarked: bytes
    marked: bytes


def made_streams(count: int, seed: int = 13) -> Iterator[Made]:
    """Yield streams; the first ones are the same whatever the count."""
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        kind = KINDS[number % len(KINDS)]
        table = ("iso", "visage")[number // len(KINDS) % 2]
        animation = _motion(kind, rng)
        given = {
            "bap_steps": table,
            "bap_quant": int(rng.choice([1, 1, 1, 2, 4, 8])),
            "intra_period": float(rng.choice([0.5, 1, 3])) if rng.random() < 0.5 else None,
            "start_codes": bool(rng.random() < 0.3),
            "clamp": True,
        }
        unmarked, marked = (
            encode_animation(animation, EncoderOptions(mark=mark, **given))[0] for mark in (False, True)
        )
        yield Made(kind, table, unmarked, marked)


def _motion(kind: str, rng: np.random.Generator) -> Animation:
    rate = int(rng.choice(RATES))
    if kind == "walk":
        return gait.walk(
            character=str(rng.choice(gait.characters())),
            rate=rate,
            cycles=2,
            in_place=bool(rng.random() < 0.3),
        )
    if kind == "capture":
        whole = _sample().resample(rate)
        return whole[: int(rng.integers(len(whole) // 4, len(whole)))]
    frames = int(rng.integers(rate, 6 * rate))
    times = np.arange(frames) / rate
    values = np.zeros((frames, 296))
    if kind == "keyed":
        _key(values, rng)
    else:
        _sway(values, times, rng, 2.0 if kind == "idle" else float(rng.uniform(10, 45)))
    if kind == "seated":
        values[:, ROOT[0]] -= float(rng.uniform(250, 450))
    if kind == "jump":
        height = np.maximum(0, 1 - (2 * (times % 1) - 1) ** 2) * float(rng.uniform(150, 450))
        values[:, ROOT[0]] += height
    if kind == "turn":
        values[:, TURN] = np.radians(float(rng.uniform(45, 170))) * 1e5 * times / times[-1]
    body = BodyTrack(np.rint(values).astype(np.int32), np.broadcast_to(values.any(axis=0), values.shape))
    return Animation(rate, range(frames), None, body)  # type: ignore[arg-type]


@cache
def _sample() -> Animation:
    with as_file(files("fba") / "samples" / "hello.bvh") as path:
        return fba.read(path)


def _sway(values: np.ndarray, times: np.ndarray, rng: np.random.Generator, degrees: float) -> None:
    """Move arms by that many degrees, and the root by a few millimetres."""
    for side in "lr":
        for name in ARMS:
            wave = np.sin(2 * np.pi * rng.uniform(0.1, 1.2) * times + rng.uniform(0, 6))
            bend = 1 + wave if name == "elbow_flexion" else wave
            values[:, bap_numbers()[f"{side}_{name}"] - 1] = np.radians(degrees * bend) * 1e5
    for column in ROOT:
        values[:, column] = rng.uniform(2, 12) * np.sin(2 * np.pi * rng.uniform(0.1, 0.5) * times)


def _key(values: np.ndarray, rng: np.random.Generator) -> None:
    """Set arms to whole fives of degrees, and go straight from key to key."""
    frames = len(values)
    keys = np.unique(np.append(np.arange(0, frames, max(frames // 4, 2)), frames - 1))
    for side in "lr":
        for name in ARMS:
            low = 0 if name == "elbow_flexion" else -6
            angles = 5.0 * rng.integers(low, 10, len(keys))
            column = bap_numbers()[f"{side}_{name}"] - 1
            values[:, column] = np.radians(np.interp(np.arange(frames), keys, angles)) * 1e5


def main(count: int) -> None:
    """Print how the table of that many streams is chosen."""
    marked, unmarked = Counter[str](), Counter[str]()
    for made in made_streams(count):
        marked["right" if choose_steps(made.marked).table == made.table else "wrong"] += 1
        choice = choose_steps(made.unmarked)
        told = choice.confidence != UNSURE
        right = choice.table == made.table
        unmarked[
            f"{made.kind}: {'right' if right else 'WRONG' if told else 'not told, the standard taken'}"
        ] += 1
    sys.stdout.write(f"{count} streams with the mark: {dict(marked)}\n")
    for kind, number in sorted(unmarked.items()):
        sys.stdout.write(f"without it: {kind}: {number}\n")


if __name__ == "__main__":
    main(int(sys.argv[1]))
