"""Small files and animations that the format tests share."""

from fractions import Fraction
from pathlib import Path

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from fba.animation import Animation, BodyTrack, FaceTrack


def mask(*numbers: int, width: int = 68) -> str:
    """A mask line with these parameters (1-based) sent."""
    return " ".join("1" if column + 1 in numbers else "0" for column in range(width))


def file(tmp_path: Path, name: str, *lines: str | bytes, end: bytes = b"\n") -> Path:
    """A file of these lines."""
    path = tmp_path / name
    path.write_bytes(b"".join((line.encode() if isinstance(line, str) else line) + end for line in lines))
    return path


@st.composite
def animations(draw: st.DrawFn, face: bool = True, body: bool = False) -> Animation:
    """Any animation that the text formats can carry."""
    count = draw(st.integers(0, 6))
    seed = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    steps = draw(st.lists(st.integers(1, 1000), min_size=count, max_size=count))
    index = np.cumsum(np.array(steps, dtype=np.int64)) + draw(st.integers(-5, 10**9))
    values = st.integers(-(2**31), 2**31 - 1)
    tracks: dict[str, FaceTrack | BodyTrack] = {}
    for name, columns in (("face", 68), ("body", 296)):
        if not (face if name == "face" else body):
            continue
        sent = seed.random((count, columns)) < draw(st.floats(0, 1))
        array = draw(hnp.arrays(np.int32, (count, columns), elements=values, fill=st.just(-77)))
        if name == "body":
            tracks[name] = BodyTrack(array, sent)
            continue
        array[:, :2] = 0
        viseme = seed.integers(0, [15, 15, 64, 2], (count, 4)).astype(np.int16)
        expression = seed.integers(0, [7, 64, 7, 64, 2, 2], (count, 6)).astype(np.int16)
        tracks[name] = FaceTrack(array, sent, viseme, expression)
    rate = draw(
        st.fractions(Fraction(1, 100), 1000, max_denominator=10**6)
        | st.sampled_from([Fraction(30000, 1001), Fraction(2997, 100)])
    )
    name = draw(st.text(max_size=20))
    return Animation(rate, index, **tracks, name=name)  # type: ignore[arg-type]


def saved(folder: Path, data: str | bytes, name: str = "a.csv") -> Path:
    path = folder / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path
