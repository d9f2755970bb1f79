"""The decoder in JavaScript finds in every stream what the one in Python finds."""

import gzip
import json
import shutil
import struct
import subprocess
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

import fba
from fba.animation import Animation
from fba.codec import Decoder, decode
from fba.codec._decoder import read_blocks, reader_for
from fba.errors import FbaError
from fba.limits import DEFAULT_LIMITS
from fba_conformance.suite.index import SHIPPED_VECTORS, read_vectors
from fba_conformance.suite.programs import check_decoder, parse_program
from tools.fuzz._engine import mutated
from tools.fuzz.corpus import read_corpus
from tools.fuzz.targets import find_target
from tools.web import make_tables

needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="no node here")
MUTANTS = 150
WEB = Path(__file__).parents[3] / "player" / "fba_player" / "web"
LONGEST_BYTEWISE = 120
"""Bytes of a stream that is also pushed byte by byte: longer ones take their time in Python."""
pytestmark = pytest.mark.filterwarnings("ignore::fba.FbaWarning")


def test_its_tables_are_those_of_the_standard() -> None:
    assert make_tables.TARGET.read_text(encoding="utf-8") == make_tables.make_tables()


@needs_node
def test_vectors(tmp_path: Path) -> None:
    _compare([vector.data() for vector in read_vectors()], tmp_path)


@needs_node
def test_damaged_streams(tmp_path: Path) -> None:
    target = find_target("stream")
    corpus = read_corpus(target)
    _compare([mutated(target, corpus, 27, number)[0] for number in range(MUTANTS)], tmp_path)


@needs_node
def test_the_bundle_does_what_the_sources_do(tmp_path: Path) -> None:
    streams = [vector.data() for vector in read_vectors()]
    bundle = tmp_path / "fba.mjs"  # the name by which node takes it for a module
    shutil.copy(WEB / "dist" / "fba.min.js", bundle)
    assert _found(streams, tmp_path, str(bundle)) == _found(streams, tmp_path)


@needs_node
def test_size() -> None:
    """What docs/web.md says of it: 8 kB with all tables."""
    assert len(gzip.compress((WEB / "dist" / "fba.min.js").read_bytes(), 9)) <= 8192


@needs_node
def test_mutants() -> None:
    """Frames or an FbaError, nothing else, in time that the size of the stream bounds."""
    program = Path(make_tables.__file__).with_name("mutants.mjs")
    done = subprocess.run(["node", program, "300", "1"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "300 mutants, 0 failures\n")


MESSAGES = {
    "dct_face": "plane 5, bit 532: DCT segments",
    "text": "plane 0, bit 0: no start code 00 00 01 ba",
    "marker_range": "plane 5, bit 668: marker bit 0",
    "mask_0_intra": "plane 5, bit 441: object mask 0",
    "viseme_above": "plane 3, bit 296: FAP 1 out of range",
    "cut_masks": "plane 5, bit 512: the stream ends in this plane",
}
REMEDY = "; the option salvage reads on"


@needs_node
def test_messages_say_where_and_what_and_what_helps() -> None:
    code = """
        import { readFileSync } from "node:fs";
        const [module, ...files] = process.argv.slice(1);
        const { decode } = await import(module);
        function show(data, options) {
            try { decode(data, options); } catch (error) { console.log(error.message); }
        }
        for (const file of files) show(readFileSync(file));
        show(readFileSync(files[0]), { bapSteps: "ISO" });
        show("text");
    """
    files = [str(SHIPPED_VECTORS / "damaged" / f"{name}.fba") for name in MESSAGES]
    command = ["node", "--input-type=module", "-e", code, (WEB / "fba.js").as_uri(), *files]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    expected = [text if name == "dct_face" else text + REMEDY for name, text in MESSAGES.items()]
    expected += ["bapSteps: expected iso or visage", "expected a Uint8Array or an ArrayBuffer"]
    assert done.stdout.splitlines() == expected


@needs_node
def test_conformance() -> None:
    """The program for `fba conformance --decoder`, with tables of steps, and with damage."""
    program = parse_program(f"node '{WEB / 'conformance.mjs'}' {{in}} {{out}} {{bap_steps}}", seconds=120)
    for vector in read_vectors():
        if vector.name in {"valid/body_visage.fba", "valid/marked_steps.fba", "damaged/two_damages.fba"}:
            result = check_decoder(program, vector)
            assert result.passed, result
            assert not result.skipped


def _compare(streams: Sequence[bytes], folder: Path) -> None:
    """Decode streams whole, salvaging and byte by byte, with both decoders; fail where they differ."""
    for number, (stream, found) in enumerate(zip(streams, _found(streams, folder), strict=True)):
        for name, salvage in (("strict", False), ("salvaged", True)):
            assert found[name] == _outcome(stream, salvage), f"stream {number}, {name}"
        assert found["bytewise"] == _bytewise(stream), f"stream {number}, byte by byte"


def _found(streams: Sequence[bytes], folder: Path, *module: str) -> list[dict[str, Any]]:
    file = folder / "streams"
    file.write_bytes(b"".join(struct.pack(">I", len(stream)) + stream for stream in streams))
    program = str(Path(__file__).with_name("decode_streams.mjs"))
    command = ["node", program, file, str(LONGEST_BYTEWISE), *module]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def _outcome(stream: bytes, salvage: bool) -> dict[str, Any]:
    on_error: Literal["raise", "salvage"] = "salvage" if salvage else "raise"
    try:
        animation = decode(stream, on_error=on_error)
    except FbaError as error:
        return {"error": _place(error)}
    reader = reader_for(memoryview(stream), bap_steps=None, on_error=on_error, limits=DEFAULT_LIMITS)
    reader.times.may_step_back = True
    for _ in read_blocks(reader, memoryview(stream)):
        pass
    return {
        "rate": str(animation.rate),
        "index": animation.index.tolist(),
        "values": _digest(animation),
        "mark": reader.objects.mark,
        "damage": [
            [
                one.start, one.stop, one.frames_lost, one.uncertainty,
                [one.doubtful.start, one.doubtful.stop] if one.doubtful else None, _place(one.error),
            ]
            for one in reader.damage
        ],
    }  # fmt: skip


def _bytewise(stream: bytes) -> dict[str, Any] | None:
    if len(stream) > LONGEST_BYTEWISE:
        return None
    decoder = Decoder()
    frames: list[fba.Frame] = []
    error = None
    try:
        for at in range(len(stream)):
            frames += decoder.push(stream[at : at + 1])
        frames += decoder.finish()
    except FbaError as raised:
        frames += [frame for block in getattr(raised, "blocks", ()) for frame in block.frames()]
        error = _place(raised)
    rows = b"".join(_rows(frame).tobytes() for frame in frames)
    return {"frames": len(frames), "values": sha256(rows).hexdigest(), "error": error}


def _place(error: Exception) -> list[int | None]:
    return [getattr(error, "plane", None), getattr(error, "bit", None)]


def _digest(animation: Animation) -> str:
    return sha256(_rows(animation).tobytes()).hexdigest()


def _rows(frames: Animation | fba.Frame) -> np.ndarray[Any, Any]:
    """Return all that frames send, int32 (T, 806)."""
    face, body = frames.face, frames.body
    count = len(face if face is not None else body or [0])
    rows = np.zeros((count, 806), dtype="<i4")
    if face is not None:
        interpolated = np.zeros_like(face.mask) if face.interpolated is None else face.interpolated
        rows[:, :214] = np.hstack([face.values, face.mask, interpolated, face.viseme, face.expression])
    if body is not None:
        rows[:, 214:] = np.hstack([body.values, body.mask])
    return rows
