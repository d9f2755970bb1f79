"""Test vectors in a folder: its index.json, and what a decoder must find in each stream.

There are two kinds of folders: those of this suite (the package's own, or the suite as a zip, unpacked),
whose index has digests of `values.Listing`, and folders whose index names the files that another decoder
wrote: `stream`, `bap_steps`, `decoded_fap`, `decoded_bap`, `epf`, `source_fap`, `source_bap`, `same_bytes`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from fba.errors import FormatError
from fba.parameters import BapTable
from fba_conformance._values import Listing, read_values

SHIPPED_VECTORS = Path(__file__).parents[1] / "vectors"
OTHER_GROUP = "vectors"
"""Group of vectors whose index does not name one."""


@dataclass(frozen=True)
class Vector:
    """An entry of an index, and the folder of its files."""

    folder: Path
    entry: dict[str, Any]

    @property
    def name(self) -> str:
        """Where the stream is in the folder."""
        return str(self.entry["stream"])

    @property
    def group(self) -> str:
        """What the vector belongs to."""
        return str(self.entry.get("group", OTHER_GROUP))

    @property
    def bap_steps(self) -> BapTable:
        """The table of BAP steps that the stream needs."""
        return cast("BapTable", self.entry.get("bap_steps", "iso"))

    @property
    def damaged(self) -> bool:
        """Whether a decoder must report an error."""
        return "error" in self.entry

    @property
    def planes_before(self) -> int:
        """Number of planes before the damage; all of them in a valid stream."""
        return int(self.entry["error"]["plane"] if self.damaged else self.entry["planes"])

    @property
    def optional(self) -> str:
        """Why a decoder may refuse the stream, "" if it must not."""
        return str(self.entry.get("optional", ""))

    @property
    def times(self) -> bool:
        """Whether the times of all planes are beyond doubt."""
        return bool(self.entry.get("times", True))

    def path(self, key: str) -> Path | None:
        """Return the path of a file of the vector, or None if it is absent."""
        return self.folder / self.entry[key] if key in self.entry else None

    def data(self) -> bytes:
        """Return the stream. Raises OSError."""
        return (self.folder / self.name).read_bytes()

    def listing(self) -> Listing | None:
        """Return the listing beside the stream, None without one. FormatError if the index has others."""
        path = (self.folder / self.name).with_suffix(".txt")
        if "values" not in self.entry or not path.is_file():
            return None
        found = read_values(path.read_text(encoding="utf-8"), str(path))
        if found.digest() != self.entry["values"]:
            raise FormatError("these are not the values whose digest is in index.json", path=path)
        return found


def index_text(entries: Sequence[dict[str, Any]]) -> str:
    """Return the content of index.json."""
    lines = ",\n".join(json.dumps(entry) for entry in entries)
    return f"[\n{lines}\n]\n"


def read_vectors(folder: Path | None = None) -> list[Vector]:
    """Return the vectors of a folder, or those that come with fba. FormatError without a valid index."""
    folder = folder or SHIPPED_VECTORS
    index = folder / "index.json"
    try:
        entries = json.loads(index.read_text(encoding="utf-8"))
        return [Vector(folder, {**entry, "stream": str(entry["stream"])}) for entry in entries]
    except FileNotFoundError:
        raise FormatError("there is no index.json in this folder of test vectors", path=folder) from None
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise FormatError(f"not an index of test vectors: {error}", path=index) from error
