"""One check for each reader of files: any bytes give an `FbaError` that names the file, or a result.

What was read must also stand what is done with it next: writing, reading again, retargeting.
"""

from __future__ import annotations

import os
import struct
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

import fba
from fba.body import BodyModel
from fba.cache import load_or_make
from fba.capture.virtual_markers import read_mapping, write_mapping
from fba.carriage.mp4 import read_mp4, write_mp4
from fba.errors import FbaError, FbaWarning
from fba.face import FaceModel
from fba.face.gltf._storage import build
from fba.face.importers import import_model
from fba.face.importers.points.points_file import read_points
from fba.formats.bvh import _reader as bvh
from fba.formats.epf.epf import read_epf, write_epf
from fba.formats.gltf import _reader as gltf
from fba.formats.smpl import _reader as smpl
from fba.formats.text.bap import read_bap, write_bap
from fba.formats.text.fap import read_fap, write_fap
from fba.gltf import read_gltf
from fba.live import KINDS, Capture, StreamFile, StreamRecorder
from fba.mesh import read_mtl, read_obj, read_ply, read_vrml, read_wfm
from fba.outlines import Index
from fba.persona import Persona
from fba.source import naming_file
from tools.fuzz._outcome import ContractError, Outcome
from tools.fuzz._small_head import small_head_obj, small_head_points, small_head_vrml

_WORLD = b"""#VRML V2.0 utf8
Shape { geometry IndexedFaceSet {
  coord Coordinate { point [ 0 0 0, 10 0 0, 0 10 5 ] } coordIndex [ 0 1 2 -1 ] } }
Shape { geometry IndexedFaceSet { coord Coordinate { point [ 3 1 2, 4 1 2, 3 2 2 ] } coordIndex [ 0 1 2 ] } }
"""
"""The mesh that an Xface file of the corpus names."""
LONGEST_CAPTURE = 2.0
"""Seconds of a live capture that are received: a body takes long for each moment."""
_CACHED = np.arange(24, dtype=np.float32).reshape(4, 6), np.arange(5, dtype=np.float32)


def check_mp4(data: bytes, folder: Path) -> Outcome:
    """Read an MP4 file; of every fourth one, write its stream again: the same values."""

    def copy(path: Path) -> None:
        animation = fba.read(path, format="mp4", salvage=bool(crc32(data) & 1))
        if crc32(data) % 4 == 0:
            with naming_file(path):
                stream = read_mp4(data, path=path, salvage=True).stream
                written = write_mp4(stream, fragment=1.0 if crc32(data) & 4 else None)
            if fba.decode(read_mp4(written).stream) != animation:
                raise ContractError("other values after writing and reading again")

    return _check_file(data, folder / "input.mp4", copy)


def check_fap(data: bytes, folder: Path) -> Outcome:
    """Read ASCII FAPs, strictly or with what can be saved of them, write them, and read them again."""
    read = partial(read_fap, salvage=bool(crc32(data) & 1))
    return _check_written(data, folder / "input.fap", read, write_fap, read_fap, attrgetter("face"))


def check_bap(data: bytes, folder: Path) -> Outcome:
    """Read ASCII BAPs, strictly or with what can be saved of them, write them, and read them again."""
    read = partial(read_bap, salvage=bool(crc32(data) & 1))
    return _check_written(data, folder / "input.bap", read, write_bap, read_bap, attrgetter("body"))


def check_epf(data: bytes, folder: Path) -> Outcome:
    """Read encoder parameters, write them, and read them again: as many planes."""
    return _check_written(data, folder / "input.epf", read_epf, write_epf, read_epf, len)


def _check_written(
    data: bytes,
    path: Path,
    read: Callable[[Path], Any],
    write: Callable[[Path, Any], object],
    read_again: Callable[[Path], Any],
    content: Callable[[Any], object],
) -> Outcome:
    """Read a file, write its content, and read it again. content: returns the part that must be equal."""

    def copy(path: Path) -> None:
        found = read(path)
        written = path.with_stem("again")
        write(written, found)
        if content(read_again(written)) != content(found):
            raise ContractError("another content after writing and reading again")

    return _check_file(data, path, copy)


def check_bvh(data: bytes, folder: Path) -> Outcome:
    """Read the motion of a BVH file, which must be finite; of every fourth one, make BAPs."""

    def read_finite(path: Path) -> None:
        if not np.isfinite(bvh.read_motion(path).rotations).all():
            raise ContractError("a rotation is no number")

    retarget = crc32(data) % 4 == 0
    return _check_file(data, folder / "input.bvh", fba.read if retarget else read_finite)


def check_gltf(data: bytes, folder: Path) -> Outcome:
    """Read a glTF file; of every second one with animations the motion, and of every fourth make BAPs."""
    way = crc32(data) % 4 if b'"animations"' in data else 0
    read = read_gltf if way < 2 else gltf.read_motion if way == 2 else fba.read
    return _check_file(data, folder / ("input.glb" if data[:4] == b"glTF" else "input.gltf"), read)


def check_capture(data: bytes, folder: Path) -> Outcome:
    """Read the capture of a face as FAPs; where it has no times, at 30 frames per second."""
    return _check_file(data, folder / "input.csv", _read_with_rate)


def check_smpl(data: bytes, folder: Path) -> Outcome:
    """Read the motion of an SMPL body; of every fourth one, make BAPs."""
    read = _read_with_rate if crc32(data) % 4 == 0 else smpl.read_motion
    return _check_file(_with_checksums(data), folder / "input.npz", read)


def check_arf(data: bytes, folder: Path) -> Outcome:
    """Read avatar animation units as FAPs and BAPs; of containers, the joints."""
    if not data.startswith(_MEMBER):
        return _check_file(data, folder / "input.aau", fba.read)
    return _check_file(_with_checksums(data), folder / "input.arfz", fba.formats.read_motion)


def check_persona(data: bytes, folder: Path) -> Outcome:
    """Load a Persona."""
    return _check_file(_with_checksums(data), folder / "input.persona", Persona.load)


def check_outlines(data: bytes, folder: Path) -> Outcome:
    """Load an index of outlines."""
    return _check_file(_with_checksums(data), folder / "input.outlines", Index.load)


_MEMBER, _DIRECTORY = b"PK\3\4", b"PK\1\2"


def _with_checksums(data: bytes) -> bytes:
    """Return an archive with the checksums of its stored members: else damage is seen before it is read.

    Of every eighth file they stay as they are.
    """
    if crc32(data) % 8 == 0:
        return data
    archive = bytearray(data)
    at = archive.find(_DIRECTORY)
    while 0 <= at <= len(archive) - 46:
        size, _, name, extra, note = struct.unpack_from("<IIHHH", archive, at + 20)
        start = int.from_bytes(archive[at + 42 : at + 46], "little")
        if archive[start : start + 4] == _MEMBER and start + 30 <= len(archive):
            first = start + 30 + sum(struct.unpack_from("<HH", archive, start + 26))
            archive[start + 14 : start + 18] = archive[at + 16 : at + 20] = struct.pack(
                "<I", crc32(archive[first : first + size])
            )
        following = at + 46 + name + extra + note
        at = following if archive[following : following + 4] == _DIRECTORY else -1
    return bytes(archive)


def _read_with_rate(path: Path) -> object:
    try:
        return fba.read(path)
    except FbaError as error:
        if not any(remedy.argument == "source_rate" for remedy in error.remedies):
            raise
        return fba.read(path, source_rate=30)


def check_live(data: bytes, folder: Path) -> Outcome:
    """Receive datagrams, and record what they show: a complete stream, whatever comes.

    The first byte chooses the kind; each datagram follows its address and its length, a byte and two.
    """
    kind = KINDS[data[0] % len(KINDS)] if data else KINDS[0]
    file = folder / "live.fba"
    file.unlink(missing_ok=True)
    recorder = StreamRecorder([StreamFile(file)])
    capture = Capture(kind, recorder.push)
    position, now = 1, 0.0
    with _strict_warnings():
        while position < len(data) and now < LONGEST_CAPTURE:
            size = int.from_bytes(data[position + 1 : position + 3], "big")
            now += 1 / 60
            capture.receive(data[position + 3 : position + 3 + size], f"10.0.0.{data[position] % 4}", now)
            capture.settle()
            capture.newest()
            position += 3 + size
        summary = capture.finish()
        recorder.finish()
    if summary.frames and len(fba.read(file)) != summary.frames:
        raise ContractError(f"{summary.frames} frames were recorded, and the file has others")
    return Outcome(not summary.refused)


def check_face(data: bytes, folder: Path) -> Outcome:
    """Load a face model; what was loaded is saved, and loaded as the same."""

    def load_twice(path: Path) -> None:
        saved = build(FaceModel.load(path)).glb()
        again = path.with_stem("again")
        again.write_bytes(saved)
        if build(FaceModel.load(again)).glb() != saved:
            raise ContractError("the face that was saved is loaded as another")

    return _check_file(data, folder / "input.glb", load_twice)


def check_body(data: bytes, folder: Path) -> Outcome:
    """Load a body model, and pose it as it was modelled."""

    def load_and_skin(path: Path) -> None:
        body = BodyModel.load(path)
        body.skin(body.bind)

    return _check_file(data, folder / "input.glb", load_and_skin)


def check_obj(data: bytes, folder: Path) -> Outcome:
    """Read an OBJ mesh."""
    return _check_file(data, folder / "input.obj", read_obj)


def check_mtl(data: bytes, folder: Path) -> Outcome:
    """Read the materials of an OBJ mesh."""
    return _check_file(data, folder / "input.mtl", lambda path: read_mtl(folder / "input.obj", path.name))


def check_mapping(data: bytes, folder: Path) -> Outcome:
    """Read a mapping of virtual markers, write it, and read the same again."""

    def read_twice(path: Path) -> None:
        mapping = read_mapping(path)
        again = folder / "again.toml"
        write_mapping(again, mapping)
        if read_mapping(again) != mapping:
            raise ContractError("the mapping that was written is read as another")

    return _check_file(data, folder / "input.toml", read_twice)


def check_ply(data: bytes, folder: Path) -> Outcome:
    """Read a PLY mesh."""
    return _check_file(data, folder / "input.ply", read_ply)


def check_vrml(data: bytes, folder: Path) -> Outcome:
    """Read the meshes of a VRML scene."""
    return _check_file(data, folder / "input.wrl", read_vrml)


def check_wfm(data: bytes, folder: Path) -> Outcome:
    """Read a wire frame."""
    return _check_file(data, folder / "input.wfm", read_wfm)


def check_points(data: bytes, folder: Path) -> Outcome:
    """Read feature points from CSV, JSON, FDP or Xface, after the first bytes."""
    start = data.lstrip()[:4]
    (folder / "head.wrl").write_bytes(_WORLD)
    suffix = ".json" if start[:1] == b"{" else ".fdp" if start[:1] == b"<" or start[:2] == b"1." else ".csv"
    return _check_file(data, folder / f"input{suffix}", read_points)


def check_import(data: bytes, folder: Path) -> Outcome:
    """Import a face from any kind of file that is recognised by its content, with what may lie beside it."""
    (folder / "head.wrl").write_bytes(small_head_vrml())
    (folder / "input.points.csv").write_bytes(small_head_points())
    (folder / "input.obj").write_bytes(small_head_obj())
    suffix = ".wfm" if data.startswith(b"# VERTEX") else ""  # wire frames are recognised by it alone
    return _check_file(data, folder / f"input{suffix}", import_model)


def check_any(data: bytes, folder: Path) -> Outcome:
    """Recognise a file by its content, and read it; of every second one, print its summary."""
    read: Callable[[Path], object] = fba.probe if crc32(data) & 1 else fba.read
    return _check_file(data, folder / "input", read)


def check_cache(data: bytes, folder: Path) -> Outcome:
    """Load arrays where the data stand in place of the cache's file: always those that were made."""
    before = os.environ.get("FBA_CACHE")
    os.environ["FBA_CACHE"] = str(folder)
    path = folder / "fba" / "fuzz.fbk"
    try:
        load_or_make("fuzz", tuple(one.shape for one in _CACHED), _arrays, np.float32)
        path.write_bytes(data)
        loaded = load_or_make("fuzz", tuple(one.shape for one in _CACHED), _arrays, np.float32)
        written = path.read_bytes()
    finally:
        if before is None:
            del os.environ["FBA_CACHE"]
        else:
            os.environ["FBA_CACHE"] = before
    if not all(np.array_equal(one, other) for one, other in zip(loaded, _CACHED, strict=True)):
        raise ContractError("a damaged file of the cache was believed")
    return Outcome(written == data)


def _arrays() -> list[np.ndarray]:
    return [one.copy() for one in _CACHED]


@contextmanager
def _strict_warnings() -> Iterator[None]:
    """Make every warning of another library an error."""
    with warnings.catch_warnings(action="error"):
        warnings.simplefilter("ignore", FbaWarning)
        yield


def _check_file(data: bytes, path: Path, read: Callable[[Path], object]) -> Outcome:
    """Read a file with this content; an FbaError must name the file."""
    path.write_bytes(data)
    with _strict_warnings():
        try:
            read(path)
        except FbaError as error:
            if path.name not in str(error):
                raise ContractError(f"the error names no file: {error}") from error
            return Outcome(False)
    return Outcome(True)
