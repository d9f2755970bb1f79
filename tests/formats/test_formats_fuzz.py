"""Cut and arbitrary texts: an error of ours, or a result. Mutated ones: tests/fuzz."""

import warnings
from pathlib import Path

from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from fba.errors import FbaError, FbaWarning
from fba.formats import read
from fba.formats.text.fap import read_fap, write_fap
from format_files import mask

WORDS = (
    b"", b" ", b"\n", b"\r", b"#", b"0", b"1", b"-1", b"2", b"1e308", b"-1e999", b"inf", b"nan", b".5",
    b"99999999999999999999",
    b"\0", b"\xff", b"1" * 70_000, b"2.1 a 25 1\n", b"3.2", b"1/0",
    b"29.97", b"FBM 3\n", b"ISI 0\n", b"FIX", b"x", b"+", b"\t", b"1 " * 68,
)  # fmt: skip

FAP = "\n".join(
    [
        "# c",
        "2.1 a b 25 3",
        mask(1, 2, 3, 50),
        "0 1 2 3 1 1 2 3 4 1 0 77 -5",
        mask(3),
        "1 5.5",
        mask(3, 68),
        "3 5 6",
        "",
    ]
).encode()


def test_cut_at_every_byte(tmp_path: Path) -> None:
    path = tmp_path / "a.fap"
    frames = []
    for end in range(1, len(FAP)):
        path.write_bytes(FAP[:end])
        with warnings.catch_warnings(action="error"):
            warnings.simplefilter("ignore", FbaWarning)
            try:
                frames.append(len(read_fap(path, salvage=True)))
            except FbaError:
                assert not frames or frames[-1] == 0, "once there is a frame, salvage keeps it"
    assert frames == sorted(frames)
    assert frames[-1] == 3


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.binary(max_size=300)
    | st.text(max_size=300).map(str.encode)
    | st.lists(st.sampled_from(WORDS)).map(b" ".join)
)
@example(b"\xef\xbb\xbf")  # a byte order mark and nothing else
def test_anything_at_all(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.fap"
    path.write_bytes(data)
    with warnings.catch_warnings(action="error"):
        warnings.simplefilter("ignore", FbaWarning)
        try:
            animation = read(path, source_rate=25) if data[:4] not in (b"\0\0\1\xba", b"\0\0\1\1") else None
            if animation is not None:
                write_fap(tmp_path / "b.fap", animation)
        except FbaError:
            pass
