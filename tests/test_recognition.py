"""What a file seems to be, by its first bytes."""

import gzip
import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import Animation, BodyTrack, FaceTrack
from fba.recognition import recognise, recognition_hint

SAMPLES = Path(fba.__file__).parent / "samples"


def zipped() -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        archive.writestr("a.txt", "text")
    return data.getvalue()


@pytest.mark.parametrize(
    ("head", "kind"),
    [
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "a PNG picture"),
        (b"\xff\xd8\xff\xe0\0\x10JFIF", "a JPEG picture"),
        (zipped(), "a ZIP archive"),
        (gzip.compress(b"HIERARCHY", mtime=0), "gzip-compressed data"),
        (b"RIFF\x24\0\0\0WAVEfmt ", "WAV sound"),
        (b"\0\0\0\x20ftypisom\0\0\2\0", "MP4 or MOV video"),
        (b"\0\0\1\xba\x44\0\4\0", "an MPEG program stream (video)"),
        (b"\0\0\1\xba\x9f\0\4\0", "an FBA stream"),
        (b"glTF\2\0\0\0", "binary glTF"),
        (b'\xef\xbb\xbf{"asset": {"version": "2.0"}}', "glTF"),
        (b'{"name": 1}', "JSON"),
        (b"\2\x50\x0a\0", "C3D motion capture"),
        (b"Kaydara FBX Binary  \0\x1a\0", "binary FBX"),
        (b"; FBX 7.3.0 project file\n", "FBX text"),
        (b"  hierarchy\r\nROOT Hips\n", "BVH motion capture"),
        ("HIERARCHY\nROOT Hips\n".encode("utf-16"), "UTF-16 text"),
        ("HIERARCHY\nROOT Hips\n".encode("utf-16-le"), "UTF-16 text"),
        (b"time,x,y\n0,1,2\n1,2,3\n", "a table (CSV)"),
        (b"<!DOCTYPE html>\n<html>", "a web page (HTML)"),
        (b"version https://git-lfs.github.com/spec/v1\n",
         "a Git LFS pointer, which stands for a file that was not downloaded"),
        (b"FBM 1 0\nFFR 0\n", "an EPF file (encoder parameters)"),
        (b"# a mesh\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "an OBJ mesh"),
        (b"\0" * 100, "nothing but zero bytes"),
        (b"\1\2\3\0\5\6\7\x08\x09" * 9, "binary data"),
        (b"# only\n# comments\n", ""),
        (b"Dear all, it was a fine day.\n", ""),
        (b"", ""),
    ],
)  # fmt: skip
def test_kinds(head: bytes, kind: str) -> None:
    assert recognise(head) == kind
    assert recognition_hint(head) == (f"; it seems to be {kind}" if kind else "")


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("a.fba", "an FBA stream"),
        ("a.fap", "a FAP file"),
        ("a.bap", "a BAP file"),
        ("a.bvh", "BVH motion capture"),
        ("a.glb", "binary glTF"),
    ],
)
def test_files_that_are_written_here(tmp_path: Path, name: str, kind: str) -> None:
    ones = np.ones((3, 68), dtype=np.int32)
    ones[:, :2] = 0
    face = FaceTrack(ones, ones.astype(bool))
    body = BodyTrack(np.ones((3, 296), dtype=np.int32), np.ones((3, 296), dtype=bool))
    parts = {".fap": (face, None), ".bap": (None, body), ".bvh": (None, body), ".glb": (None, body)}
    path = tmp_path / name
    fba.write(path, Animation(25, np.arange(3), *parts.get(path.suffix, (face, body))))
    assert recognise(path.read_bytes()[:4096]) == kind


@pytest.mark.parametrize("suffix", [".fba", ".fap", ".bap", ".epf", ".bvh", ".glb", ".gltf", ""])
@pytest.mark.parametrize("kind", ["a PNG picture", "gzip-compressed data", "a table (CSV)"])
def test_every_reader_says_what_a_foreign_file_seems_to_be(tmp_path: Path, suffix: str, kind: str) -> None:
    content = {
        "a PNG picture": b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR",
        "gzip-compressed data": gzip.compress(b"HIERARCHY", mtime=0),
        "a table (CSV)": b"time,x,y\n0,1,2\n1,2,3\n",
    }[kind]
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    with pytest.raises(fba.FbaError) as caught:
        fba.read(path)
    assert f"it seems to be {kind}" in str(caught.value)


def test_a_face_model_that_is_none() -> None:
    from fba.face.importers import import_model

    with pytest.raises(fba.ModelError, match="it seems to be BVH motion capture"):
        import_model(SAMPLES / "hello.bvh")


@pytest.mark.parametrize(
    ("head", "kind"),
    [
        (b"a,b\n1,2\n", ""),
        (b"a,b\n1,2\n3,4\n", "a table (CSV)"),
        (b"0 " * 59, ""),
        (b"0 " * 60, "a FAP file"),
        (b"1 " * 99, "a FAP file"),
        (b"1 " * 100, "a BAP file"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nx y\n", "an OBJ mesh"),
        (b"v 0 0 0\nv 1 0 0\n", ""),
        (b"\0\0\1\xba\x44\0", "an MPEG program stream (video)"),
        (b"\0\0\1\xba\x21\0", "an MPEG program stream (video)"),
        (b"\0\0\1\xba\x04\0", "an FBA stream"),
        (b"\x02\x50\1", "C3D motion capture"),
        (b"\x07\x50\1", "C3D motion capture"),
    ],
)
def test_where_one_kind_ends_and_another_begins(head: bytes, kind: str) -> None:
    assert recognise(head) == kind
