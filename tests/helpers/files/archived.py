"""A folder of performances of two subjects, and an archive of them."""

from pathlib import Path

import numpy as np

import fba
from fba import Animation, BodyTrack, EncoderOptions, FaceTrack
from fba.archive import Coding, Report, find_sources, label_by_folders, make_archive
from made_motion import made_face

FRAMES = 260
CODING = Coding(period=2.0)
NAMES = ("anna/joy/both", "anna/joy/talk", "ben/sad/masks", "ben/sad/walk")


def performance(seed: int, *, face: bool = True, body: bool = False, frames: int = FRAMES) -> Animation:
    rng = np.random.default_rng(seed)
    return Animation(
        25, np.arange(25, 25 + frames), _low_level(rng, frames) if face else None,
        _turns(rng, frames) if body else None,
    )  # fmt: skip


def _low_level(rng: np.random.Generator, frames: int) -> FaceTrack:
    """A face that sends the same FAPs throughout, and no visemes and expressions, which may be redefined."""
    made = made_face(rng, frames)
    sent = made.mask.any(axis=0) & (np.arange(68) > 1)
    return FaceTrack(made.values * sent, np.broadcast_to(sent, made.mask.shape))


def _turns(rng: np.random.Generator, frames: int) -> BodyTrack:
    """Forty BAPs that turn a little from frame to frame, by whole steps of either table."""
    values = np.zeros((frames, 296), np.int32)
    values[:, :40] = 512 * np.cumsum(rng.integers(-2, 3, (frames, 40)), axis=0)
    return BodyTrack(values, np.broadcast_to(values.any(axis=0), values.shape))


def changing_masks(frames: int = FRAMES) -> Animation:
    """A face that sends other FAPs from second to second, visemes and expressions among them."""
    rng = np.random.default_rng(5)
    values = np.cumsum(rng.integers(-9, 10, (frames, 68)), axis=0).astype(np.int32)
    values[:, :2] = 0
    mask = np.repeat(rng.random((-(-frames // 30), 68)) < 0.6, 30, axis=0)[:frames]
    viseme = np.zeros((frames, 4), np.int16)
    expression = np.zeros((frames, 6), np.int16)
    viseme[:, 0], viseme[:, 2] = np.arange(frames) // 20 % 14, 40
    expression[:, 0], expression[:, 1] = 1 + np.arange(frames) // 50 % 6, 50
    viseme[~mask[:, 0]] = 0
    expression[~mask[:, 1]] = 0
    return Animation(25, np.arange(frames), FaceTrack(np.where(mask, values, 0), mask, viseme, expression))


def write_folder(folder: Path) -> Path:
    """Write two faces, a face with a body and a body into folders of subjects and emotions."""
    for name in NAMES:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
    fba.write(folder / "anna/joy/talk.fap", performance(1))
    options = EncoderOptions(intra_period=1, start_codes=True, bap_steps="visage")
    fba.write(folder / "anna/joy/both.fba", performance(2, body=True), options=options)
    fba.write(folder / "ben/sad/masks.fba", changing_masks(), options=options)
    fba.write(folder / "ben/sad/walk.bap", performance(3, face=False, body=True))
    return folder


def make(folder: Path, target: Path, **options: object) -> list[Report]:
    sources = label_by_folders(find_sources([folder]), ["subject", "emotion"])
    return list(make_archive(sources, target, **options))  # type: ignore[arg-type]


def body_of(animation: Animation) -> BodyTrack:
    assert animation.body is not None
    return animation.body


def face_of(animation: Animation) -> FaceTrack:
    assert animation.face is not None
    return animation.face
