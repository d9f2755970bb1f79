"""Vectors of time: frame rates, skipped frames, time codes, and streams that one joins in the middle."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from tools.vectors.definitions._targets import FEW_BAPS, FEW_FAPS, bodies, edited, faces, script, scripted
from tools.vectors.definitions.case import Case
from tools.vectors.stream_writer import PLANE, write_stream

_SKIPS = (0, 1, 2, 14, 15, 16, 29, 30, 31, 200)
_LONG_SKIP = 15 * 3000 + 7


def time_cases() -> Iterator[Case]:
    """Yield streams of frame rates, skips and time codes."""
    yield from _rate_cases()
    yield from _skip_cases()
    yield from _time_code_cases()


def _rate_cases() -> Iterator[Case]:
    """Yield streams of frame rates."""
    for name, rate, text in (
        ("rate_30_5", (30, 8, 0), "30 1/2 frames/s"),
        (
            "rate_ntsc",
            (30, 0, 1),
            "30000/1001 frames/s, and 1500 skipped frames, so that the difference shows",
        ),
        ("rate_sixteenths_ntsc", (29, 15, 1), "29 15/16 frames/s, times 1000/1001"),
        ("rate_slowest", (0, 1, 0), "1/16 frame/s"),
        ("rate_fastest", (255, 15, 0), "255 15/16 frames/s"),
    ):
        planes = edited(script(faces(5, (3, 4)), rate=rate), {2: {"skip": 1500}})
        yield Case(name, text, partial(write_stream, planes))
    yield Case(
        "rate_changes", "25, 30, 12 1/2 and 30000/1001 frames/s, one after the other",
        lambda: write_stream(
            edited(
                script(faces(16, (3, 4)), intra=(0, 4, 8, 12)),
                {4: {"rate": (30, 0, 0)}, 8: {"rate": (12, 8, 0), "skip": 3}, 12: {"rate": (30, 0, 1)}},
            )
        ),
        encodes=False,
    )  # fmt: skip
    yield Case(
        "rate_sixteenths", "20 frames/s and 0 to 15 sixteenths more, in 16 I planes",
        lambda: write_stream(
            edited(script(faces(16, (3,)), intra=range(16)), {n: {"rate": (20, n, 0)} for n in range(16)})
        ),
        encodes=False,
    )  # fmt: skip
    yield Case(
        "rate_repeated", "the same frame rate in every I plane",
        lambda: write_stream(
            edited(
                script(faces(9, (3, 4)), intra=(0, 3, 6), rate=(50, 0, 0)),
                {3: {"rate": (50, 0, 0)}, 6: {"rate": (50, 0, 0)}},
            )
        ),
    )  # fmt: skip
    yield Case(
        "rate_missing", "no frame rate anywhere", scripted(faces(5, (3,)), rate=None),
        times=False,
    )  # fmt: skip


def _skip_cases() -> Iterator[Case]:
    """Yield streams with skipped frames."""
    yield Case("skips", f"skipped frames in P planes: {', '.join(map(str, _SKIPS))}", lambda: _skips(()))
    yield Case("skips_intra", "the same in I planes, with FAPs and BAPs", lambda: _skips(range(len(_SKIPS))))
    yield Case(
        "skip_long", f"{_LONG_SKIP} skipped frames: 3001 words",
        lambda: write_stream(edited(script(faces(5, (3,))), {2: {"skip": _LONG_SKIP}})),
    )  # fmt: skip


def _time_code_cases() -> Iterator[Case]:
    """Yield streams with time codes."""
    yield Case(
        "time_code", "a first time code of 5:59:59",
        lambda: write_stream(edited(script(faces(6, (3, 4))), {0: {"time_code": (5, 59, 1, 59)}})),
    )  # fmt: skip
    yield Case(
        "time_codes_forward", "time codes that leave gaps; the last is the latest that there is, 31:59:59",
        lambda: write_stream(
            edited(
                script(faces(15, (3, 4)), intra=range(0, 15, 3)),
                {
                    0: {"time_code": (0, 0, 1, 0)},
                    3: {"time_code": (0, 0, 1, 1)},
                    6: {"time_code": (0, 1, 1, 0), "skip": 2},
                    9: {"time_code": (23, 59, 1, 59)},
                    12: {"time_code": (31, 59, 1, 59), "skip": 16},
                },
            )
        ),
    )  # fmt: skip
    yield Case(
        "time_code_marker", "a time code whose marker bit is 0",
        lambda: write_stream(
            edited(script(faces(6, (3,)), intra=(0, 3)), {3: {"time_code": (1, 2, 0, 3)}})
        ),
        times=False, optional="the marker bit of a time code must be 1; two decoders read on",
    )  # fmt: skip
    yield Case(
        "time_code_back", "a time code before the last plane",
        lambda: write_stream(
            edited(
                script(faces(6, (3,)), intra=(0, 3)),
                {0: {"time_code": (0, 0, 1, 9)}, 3: {"time_code": (0, 0, 1, 3)}},
            )
        ),
        times=False,
    )  # fmt: skip


def join_cases() -> Iterator[Case]:
    """Yield streams that begin in the middle, as somebody receives them who joins later."""
    yield Case(
        "join_at_time_code", "an object that begins in the middle: a start code, a time code, all ranges",
        lambda: write_stream(
            edited(
                script(faces(24, FEW_FAPS), intra=(0, 12))[12:],
                {0: {"start_code": PLANE, "time_code": (0, 7, 1, 30), "rate": (25, 0, 0)}},
            )
        ),
    )  # fmt: skip
    yield Case(
        "join_every_5", "start code, frame rate, time code and all ranges with every fifth plane",
        lambda: write_stream(
            edited(
                script(faces(20, FEW_FAPS), bodies(20, FEW_BAPS[:8]), intra=range(0, 20, 5), rate=(5, 0, 0)),
                {
                    frame: {"start_code": PLANE, "rate": (5, 0, 0), "time_code": (0, 0, 1, frame // 5)}
                    for frame in range(5, 20, 5)
                },
            )
        ),
    )  # fmt: skip
    yield Case(
        "join_face_first", "an object that begins with a face; the body follows with its next I plane",
        lambda: write_stream(
            edited(
                script(faces(12, FEW_FAPS), bodies(12, FEW_BAPS), intra=(0, 5), rate=(25, 0, 0)),
                {
                    **{frame: {"bap": None} for frame in range(5)},
                    5: {"fap": None, "start_code": PLANE, "rate": (25, 0, 0)},
                },
            )
        ),
    )  # fmt: skip


def _skips(intra: range | tuple[()]) -> bytes:
    planes = script(
        faces(len(_SKIPS), (3, 4)), bodies(len(_SKIPS), (1,)) if intra else None, intra=intra or (0,)
    )
    return write_stream(edited(planes, {number: {"skip": skip} for number, skip in enumerate(_SKIPS)}))
