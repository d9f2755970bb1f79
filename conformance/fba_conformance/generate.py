"""Write the test vectors: `python -m fba_conformance.generate [FOLDER]`.

The independent decoder reads every stream, and the digest of its values goes into the index, so that the
tested codec does not define what is right. A stream that the two decode differently is an error.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from fba_conformance._cases import Case, cases
from fba_conformance.runner import OWN, Vector, check, digest
from fba_conformance.trace import decode_values


def generate(folder: Path) -> list[dict[str, Any]]:
    """Write all vectors and their index into a folder; return the index."""
    folder.mkdir(parents=True, exist_ok=True)
    index = []
    for case in cases():
        data = case.make()
        (folder / f"{case.name}.fba").write_bytes(data)
        entry = index_entry(case, data)
        result = check(Vector(folder, entry))
        if not result.passed:
            raise SystemExit(f"{result.line()}")
        index.append(entry)
    lines = ",\n".join(json.dumps(entry) for entry in index)
    (folder / "index.json").write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    return index


def index_entry(case: Case, data: bytes) -> dict[str, Any]:
    """Return the entry of a stream in the index, from the independent decoder."""
    records = [_record(plane) for plane in decode_values(data, bap_steps=case.bap_steps)]
    return {
        "stream": f"{case.name}.fba",
        "tests": case.tests,
        "bap_steps": case.bap_steps,
        "planes": len(records),
        "values": digest(records),
        "same_bytes": case.encodes,
    }


def _record(plane: dict[str, Any]) -> dict[str, Any]:
    """Return the part of a plane's content that the digest covers."""
    return {
        "intra": bool(plane["intra"]),
        "skip": plane["skip"],
        "rate": str(plane["rate"]),
        "bits": plane["bits"],
        "fap": {str(number): value for number, value in plane["fap"].items()},
        "viseme": list(plane["viseme"]) if plane["viseme"] is not None else None,
        "expression": list(plane["expression"]) if plane["expression"] is not None else None,
        "bap": {str(number): value for number, value in plane["bap"].items()},
    }


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else OWN
    sys.stdout.write(f"{len(generate(target))} vectors in {target}\n")
