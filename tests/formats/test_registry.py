"""Which format a file is in, what its options are, and everything that is no such file."""

import contextlib
import functools
import io
import os
import re
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from fba.animation import Animation, BodyTrack, FaceTrack
from fba.errors import BitstreamError, FbaWarning, FormatError, UnsupportedError
from fba.formats import OptionError, format_of, formats, merge, read_face, read_motion
from fba.source import read_head
from format_files import file, mask

FAP = ("2.1 a 25 1", mask(3), "0 5")
BAP = ("3.1 a 25 1", mask(3, width=186), "0 5")


def performance(face: bool = True, body: bool = True, rate: int = 25, first: int = 0) -> Animation:
    values = np.full((3, 296), 64, np.int32)
    faps = np.full((3, 68), 30, np.int32)
    faps[:, :2] = 0
    return Animation(
        Fraction(rate),
        np.arange(first, first + 3),
        FaceTrack(faps, np.ones((3, 68), bool)) if face else None,
        BodyTrack(values, np.arange(296) < np.full((3, 1), 186)) if body else None,
        "face" if face else "body",
    )


def test_the_table() -> None:
    assert [entry.name for entry in formats()] == [
        "fba", "fap", "bap", "epf", "bvh", "vrma", "gltf", "smpl", "arf", "mp4", "openface", "pyfeat",
        "livelink",
        "livelink-udp", "ifacialmocap", "shapes-json", "points", "c3d", "trc", "motive", "nexus", "qualisys",
        "markers",
    ]  # fmt: skip
    by_name = {entry.name: entry for entry in formats()}
    assert by_name["fap"].read_options == ("source_rate", "name", "salvage", "angle_scale", "limits")
    assert by_name["fap"].write_options == by_name["epf"].write_options == ()
    assert "bap_steps" in by_name["fba"].read_options
    assert "fap_quant" in by_name["fba"].write_options


@pytest.mark.parametrize(
    ("name", "lines", "found"),
    [
        ("a.fap", FAP, "fap"),
        ("a", FAP, "fap"),
        ("a.FAP", FAP[1:], "fap"),
        ("a.dat", ("#", "", *FAP), "fap"),
        ("a", BAP[1:], "bap"),
        ("a.txt", BAP, "bap"),
        ("a", ("2.1 x 25 1", mask(width=186), "0"), "bap"),
        ("a", ("2.2 empty 25 0",), "fap"),
        ("a", ("HIERARCHY", "ROOT Hips"), "bvh"),
        ("a.mot", ("# x", "FBM 1"), "epf"),
        ("a", (b"\0\0\1\xba\xff",), "fba"),
        ("a", (b"\0\0\1\x01\xff",), "fba"),
        ("a", (b"\0\0\1\xb0\1\0\0\1\xb5\x09\0\0\1\xba\xff",), "fba"),
        ("a.fba", (b"\0\0\1\xba\x44",), "fba"),
        ("a.fba", (b"damaged\xff",), "fba"),
        ("a.fap", ("# " + "x" * 60 + "\n") * 2000, "fap"),
    ],
)  # fmt: skip
def test_content_decides(tmp_path: Path, name: str, lines: tuple[str | bytes, ...], found: str) -> None:
    assert format_of(file(tmp_path, name, *lines)).name == found


def test_a_wrong_suffix_is_a_warning(tmp_path: Path) -> None:
    path = file(tmp_path, "a.fap", *BAP)
    with pytest.warns(FbaWarning, match=r"is named \.fap, but holds BAP content; read as bap"):
        assert fba.read(path).body is not None
    with pytest.raises(FormatError, match="mask of 68 bits, found 186"), pytest.warns(FbaWarning):
        fba.read(path, format="fap")


@pytest.mark.parametrize(
    "content", [b"1.0 face\n2.1 0 0 0 5\n", b"\x89PNG\r\n", b"\0\0\1\xba\x44\0", b"\xff" * 9]
)
def test_other_files(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.dat"
    path.write_bytes(content)
    with pytest.raises(FormatError, match=r"no format known here: FBA \(\.fba\), FAP"):
        fba.read(path)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (b"\0\0\1\xba" * 5000, "the name of a file is needed, not bytes; fba.decode(data) decodes the bytes"),
        (bytearray(b"2.2 a 25 1"), "not bytearray; fba.decode(data) decodes the bytes of a stream"),
        (io.BytesIO(b"2.2 a 25 1"), "not BytesIO; give its name"),
        (performance(), "not Animation; give its name"),
    ],
)
def test_names_of_files_of_wrong_types(given: Any, text: str) -> None:
    for read in (fba.read, functools.partial(fba.read, format="fap")):
        with pytest.raises(OptionError, match=re.escape(text)) as caught:
            read(given)
        assert len(str(caught.value)) < 120


def test_paths_that_are_no_readable_file(tmp_path: Path) -> None:
    (tmp_path / "empty.fap").write_bytes(b"")
    os.mkfifo(tmp_path / "pipe.fap")
    for path, message in (
        (tmp_path, "is a folder"),
        (tmp_path / "missing.fap", "no such file"),
        (tmp_path / "empty.fap", "is empty"),
        (tmp_path / "pipe.fap", "a pipe or a device"),
        ("/dev/zero", "a pipe or a device"),
        (f"{tmp_path}/\0", "cannot be read"),
        (tmp_path / ("x" * 300), "cannot be read"),
    ):
        for options in ({}, {"format": "fap"}, {"format": "fba"}):
            with pytest.raises(FormatError, match=message):
                fba.read(path, **options)  # type: ignore[arg-type]


def test_options(tmp_path: Path) -> None:
    path = file(tmp_path, "a.fap", *FAP[1:])
    assert fba.read(path, source_rate=30, name="x").rate == 30
    with pytest.raises(
        OptionError, match="reading fap takes no option 'speed'; it takes source_rate, name, salvage, angle"
    ):
        fba.read(path, speed=3)
    with pytest.raises(TypeError, match="bap_steps"):
        fba.read(path, bap_steps="iso")
    with pytest.raises(OptionError, match="no format 'ogg'; known: fba, fap, bap, epf, bvh"):
        fba.read(path, format="ogg")
    with pytest.raises(OptionError, match="writing fap takes no option 'source_rate'; it takes none"):
        fba.write(tmp_path / "b.fap", performance(), source_rate=3)
    with pytest.raises(OptionError, match="writing fba takes no option 'quant'; it takes options, fap_quant"):
        fba.write(tmp_path / "b.fba", performance(), quant=3)
    with pytest.raises(OptionError, match="either options or fap_quant"):
        fba.write(tmp_path / "b.fba", performance(), options=fba.EncoderOptions(), fap_quant=3)


SAMPLES = Path(fba.__file__).parent / "samples"


def test_captures_are_read_as_the_file_has_them() -> None:
    motion = read_motion(SAMPLES / "hello.bvh")
    assert (motion.rate, len(motion), motion.names[0]) == (60, 576, "Hips")
    markers = read_face(SAMPLES / "talk.c3d", format="c3d", limits=fba.Limits())
    assert (markers.rate, markers.positions.shape) == (50, (300, 50, 3))


def test_captures_of_the_other_kind_are_refused() -> None:
    with pytest.raises(FormatError, match=r"hello\.bvh: is BVH, which holds .* captured face"):
        read_face(SAMPLES / "hello.bvh")
    with pytest.raises(FormatError, match=r"talk\.c3d: is C3D, which holds .* captured skeleton"):
        read_motion(SAMPLES / "talk.c3d")
    with pytest.raises(OptionError, match="reading bvh takes no option 'spine'"):
        read_motion(SAMPLES / "hello.bvh", spine="full")


def test_writing_chooses_by_suffix(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"known: FBA \(\.fba\), FAP \(\.fap\), BAP \(\.bap\), .*'\.mpg'"):
        fba.write(tmp_path / "a.mpg", performance())
    with pytest.raises(UnsupportedError, match="EPF can be read only"):
        fba.write(tmp_path / "a.epf", performance())
    fba.write(tmp_path / "a.mpg", performance(body=False), format="fap")
    assert fba.read(tmp_path / "a.mpg") == performance(body=False)
    with pytest.warns(FbaWarning, match="FAP holds no body; only the face was written"):
        fba.write(tmp_path / "a.FAP", performance())
    assert fba.read(tmp_path / "a.FAP") == performance(body=False)


def test_fba_files(tmp_path: Path) -> None:
    path = tmp_path / "dance.fba"
    fba.write(path, performance(), fap_quant=1, bap_quant=0)
    animation = fba.read(path)
    assert animation.name == "dance"
    assert animation.body == performance().body
    assert path.read_bytes()[:4] == b"\0\0\1\xba"
    assert fba.probe(path).frames == fba.probe(path.read_bytes()).frames == 3
    path.write_bytes(path.read_bytes()[:40])
    with pytest.raises(BitstreamError, match=r"dance\.fba: "):
        fba.read(path)


def test_probe_of_another_format(tmp_path: Path) -> None:
    path = file(tmp_path, "a.fap", *FAP)
    info, animation = fba.probe(path), fba.read(path)
    assert (info.format, info.size, info.frames) == ("fap", path.stat().st_size, len(animation))
    assert info.rate == animation.rate
    assert info.intra_planes is None


def test_merge_joins_by_frame_number() -> None:
    joined = merge(performance(body=False, first=1), performance(face=False, first=2))
    assert (joined.index.tolist(), joined.name) == ([1, 2, 3, 4], "face")
    assert joined.face.mask.any(axis=1).tolist() == [True, True, True, False]
    assert joined.body.mask.any(axis=1).tolist() == [False, True, True, True]
    assert joined.face.values[:, 5].tolist() == [30, 30, 30, 0]
    assert joined.body.values[:, 5].tolist() == [0, 64, 64, 64]


def test_merge_refuses_what_does_not_fit() -> None:
    with pytest.raises(FormatError, match="'face' has 25 frames/s, 'body' 30; resample"):
        merge(performance(body=False), performance(face=False, rate=30))
    with pytest.raises(FormatError, match="'body' has no face"):
        merge(performance(face=False), performance(face=False))
    with pytest.raises(FormatError, match="'face' has no body"):
        merge(performance(body=False), performance(body=False))


def test_real_files_are_recognised_without_their_suffix(shared: Path, tmp_path: Path) -> None:
    count = 0
    for path in sorted(shared.rglob("*")):
        suffix = path.suffix.lower()
        if suffix not in (".fba", ".bvh", ".fap", ".bap", ".epf"):
            if suffix in (".fdp", ".wav", ".xml", ".json", ".trace", ".csv", ".md"):
                with contextlib.suppress(FormatError):
                    assert format_of(path).read_face is not None, path
            continue
        nameless = tmp_path / "nameless"
        nameless.unlink(missing_ok=True)
        nameless.symlink_to(path)
        assert [entry.name for entry in formats() if entry.sniff(read_head(nameless), "")] == [suffix[1:]], (
            path
        )
        count += 1
    assert count > 600
