"""Run this codec over test vectors: decoded values and encoded bytes must be exact.

There are two kinds of folders: the vectors that come with fba (`vectors`, with digests in the index), and
folders whose index names the files that another decoder wrote: `stream`, `bap_steps`, `decoded_fap`,
`decoded_bap`, `epf`, `source_fap`, `source_bap`, `same_bytes`.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from fba.animation import Animation, Frame
from fba.codec import Decoder, PlaneSettings, encode_planes
from fba.errors import FbaError, FbaWarning, FormatError

OWN = Path(__file__).with_name("vectors")


@dataclass(frozen=True)
class Vector:
    """An entry of an index, and the folder of its files."""

    folder: Path
    entry: dict[str, Any]

    @property
    def name(self) -> str:
        """The stream's file name."""
        return str(self.entry["stream"])

    @property
    def bap_steps(self) -> str:
        """The table of BAP steps that the stream needs."""
        return str(self.entry.get("bap_steps", "iso"))

    def path(self, key: str) -> Path | None:
        """Return the path of a file of the vector, or None if there is none."""
        return self.folder / self.entry[key] if key in self.entry else None


@dataclass(frozen=True)
class Result:
    """Result of a vector.

    decoded, encoded: whether values and bytes are exact; encoded is None if bytes are not compared. message:
    what was wrong.
    """

    name: str
    decoded: bool
    encoded: bool | None
    message: str = ""

    @property
    def passed(self) -> bool:
        """Whether it was decoded exactly, and encoded exactly if that was tried."""
        return self.decoded and self.encoded is not False

    def to_dict(self) -> dict[str, Any]:
        """Return the result for JSON."""
        return {**asdict(self), "passed": self.passed}

    def line(self) -> str:
        """Return the result in one line of text."""
        words = {True: "exact", False: "WRONG", None: "-"}
        text = f"{self.name}: decoded {words[self.decoded]}, encoded {words[self.encoded]}"
        return f"{text}: {self.message}" if self.message else text


def vectors(folder: Path | None = None) -> list[Vector]:
    """Return the vectors of a folder, or those that come with fba. FormatError without a valid index."""
    folder = folder or OWN
    index = folder / "index.json"
    try:
        entries = json.loads(index.read_text(encoding="utf-8"))
        return [Vector(folder, {**entry, "stream": str(entry["stream"])}) for entry in entries]
    except FileNotFoundError:
        raise FormatError("there is no index.json in this folder of test vectors", path=folder) from None
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise FormatError(f"not an index of test vectors: {error}", path=index) from error


def check(vector: Vector) -> Result:
    """Decode a vector and, if its bytes can be reproduced, encode it again."""
    stream = vector.folder / vector.name
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FbaWarning)
            data = stream.read_bytes()
            decoder = Decoder(bap_steps=vector.bap_steps)
            frames = decoder.push(data) + decoder.finish()
            wrong = (
                _check_digest(vector, frames) if "values" in vector.entry else _check_files(vector, frames)
            )
            if wrong:
                return Result(vector.name, False, None, wrong)
            if not vector.entry.get("same_bytes", False):
                return Result(vector.name, True, None)
            again = _encode(vector, frames)
    except (FbaError, OSError) as error:
        return Result(vector.name, False, None, str(error))
    if again == data:
        return Result(vector.name, True, True)
    pairs = enumerate(zip(again, data, strict=False))
    position = next((i for i, (ours, theirs) in pairs if ours != theirs), min(len(again), len(data)))
    return Result(
        vector.name,
        True,
        False,
        f"{len(again)} bytes, expected {len(data)}; they differ from byte {position} on",
    )


def plane_records(frames: Iterable[Frame]) -> list[dict[str, Any]]:
    """Return the content of the planes of decoded frames, in the form of the independent reader."""
    records = []
    for frame in frames:
        record: dict[str, Any] = {
            "intra": frame.plane.settings.intra,
            "skip": frame.plane.settings.skip,
            "rate": str(frame.rate),
            "bits": frame.plane.bits,
            "fap": {},
            "viseme": None,
            "expression": None,
            "bap": {},
        }
        if frame.face is not None:
            mask, values = frame.face.mask[0], frame.face.values[0]
            record["fap"] = {str(i + 1): int(values[i]) for i in mask[2:].nonzero()[0] + 2}
            record["viseme"] = frame.face.viseme[0].tolist() if mask[0] else None
            record["expression"] = frame.face.expression[0].tolist() if mask[1] else None
        if frame.body is not None:
            mask, values = frame.body.mask[0], frame.body.values[0]
            record["bap"] = {str(i + 1): int(values[i]) for i in mask.nonzero()[0]}
        records.append(record)
    return records


def digest(records: Sequence[dict[str, Any]]) -> str:
    """Return a digest of `plane_records`, as hexadecimal text."""
    lines = (json.dumps(record, sort_keys=True, separators=(",", ":")) for record in records)
    return sha256("\n".join(lines).encode()).hexdigest()


def _check_digest(vector: Vector, frames: list[Frame]) -> str:
    """Return how decoded frames differ from the digest in the index, or ""."""
    records = plane_records(frames)
    if len(records) != vector.entry["planes"]:
        return f"{len(records)} planes, expected {vector.entry['planes']}"
    return "" if digest(records) == vector.entry["values"] else "the decoded values differ"


def _check_files(vector: Vector, frames: list[Frame]) -> str:
    """Return how decoded frames differ from the files of another decoder, or ""; it numbers planes."""
    from fba.formats.text.bap import read_bap
    from fba.formats.text.fap import read_fap

    animation = Animation.from_frames(frames)
    for key, reader in (("decoded_fap", read_fap), ("decoded_bap", read_bap)):
        path = vector.path(key)
        if path is None:
            continue
        expected = reader(path)
        ours, theirs = (
            (animation.face, expected.face) if key == "decoded_fap" else (animation.body, expected.body)
        )
        if ours is None or theirs is None or len(ours) != len(theirs):
            return f"{0 if ours is None else len(ours)} planes, expected {len(expected)} ({path.name})"
        if ours != theirs:
            return f"the decoded values differ from {path.name}"
    return ""


def _encode(vector: Vector, frames: list[Frame]) -> bytes:
    """Return the stream encoded again, from its EPF file and source or from the decoded planes."""
    from fba.formats import merge
    from fba.formats.epf.epf import read_epf
    from fba.formats.text.bap import read_bap
    from fba.formats.text.fap import read_fap

    script, fap, bap = vector.path("epf"), vector.path("source_fap"), vector.path("source_bap")
    if script is None:
        settings: list[PlaneSettings] = [frame.plane.settings for frame in frames]
        return encode_planes(Animation.from_frames(frames), settings, bap_steps=vector.bap_steps)
    face = read_fap(fap) if fap is not None else None
    body = read_bap(bap) if bap is not None else None
    animation = merge(face, body) if face is not None and body is not None else face or body
    if animation is None:
        raise FormatError("the index names an EPF file, but no source to encode", path=script)
    return encode_planes(animation, read_epf(script), bap_steps=vector.bap_steps)
