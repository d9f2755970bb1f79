"""The suite as a zip, for use without Python: streams, expected values as text, checksums, a README.

Nothing in it is compressed, and all times are the same, so that its bytes do not depend on the machine:
versions of zlib compress differently.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Iterator
from hashlib import sha256
from typing import Any, BinaryIO

from fba_conformance.suite.index import Vector, index_text
from fba_conformance.suite.runner import expected_listing

NAME = "fba-conformance"
"""The folder in the zip."""
_TIME = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a zip can contain."""

_README = """\
FBA CONFORMANCE SUITE

Test vectors for decoders of MPEG-4 Face and Body Animation (ISO/IEC 14496-2, FBA object; predictive coding).
Part of fba, under the MIT licence.

  valid/NAME.fba     a stream that every decoder must decode
  valid/NAME.txt     the values that it must find
  damaged/NAME.fba   a stream with damage
  damaged/NAME.txt   the values before the damage, a line "error", and those that can be salvaged behind it
  index.json         the tables below, for programs
  SHA256SUMS         checksums of all other files: sha256sum -c SHA256SUMS

THE VALUES

Text, a line for each value, every plane in the order of the stream:

  fba-values 1                     the first line
  plane                            begins a plane, also one that sends nothing
  time 13/25                       seconds at which it is shown
  viseme 1 0 63 0                  FAP 1: select1, select2, blend, viseme_def
  expression 3 40 0 0 0 0          FAP 2: select1, intensity1, select2, intensity2, init_face, expression_def
  fap 3 120                        FAP 3 to 68: number, value
  bap 19 -1792                     BAP 1 to 296: number, value
  error                            the stream is damaged here
  end                              the last line

Only what a plane sends is listed, in the standard's units, after dequantisation and prediction. Let your
decoder write this and compare: `cmp` if it writes the lines in the same order (as above; FAPs and BAPs by
number), without times if it knows none (grep -v '^time ').

Steps of BAPs: streams marked "visage" were quantised with another table than the standard's, which a decoder
must be told: 170 in place of 64 and 128, and 2 for BAPs 181 to 183.

A damaged stream passes if the decoder ends within reasonable time, reports an error, and gives no plane that
is not in the list: all of them, or only some of those before the damage.

With Python, `fba conformance FOLDER --decoder 'yours {in} {out}'` does all that.

"""


def write_archive(file: BinaryIO, vectors: Iterable[Vector]) -> int:
    """Write the zip; return the number of vectors."""
    contents = dict(_files(vectors))
    sums = "".join(f"{sha256(data).hexdigest()}  {name}\n" for name, data in sorted(contents.items()))
    contents["SHA256SUMS"] = sums.encode()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for name, data in sorted(contents.items()):
            info = zipfile.ZipInfo(f"{NAME}/{name}", _TIME)
            info.create_system = 3  # Unix, on every system
            info.external_attr = 0o644 << 16
            archive.writestr(info, data)
    return sum(name.endswith(".fba") for name in contents)


def _files(vectors: Iterable[Vector]) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of streams, values, index and README."""
    entries = []
    for vector in vectors:
        entries.append(vector.entry)
        yield vector.name, vector.data()
        yield vector.name.replace(".fba", ".txt"), expected_listing(vector).text().encode()
    yield "index.json", index_text(entries).encode()
    yield "README.txt", (_README + "\n".join(_vector_table(entries)) + "\n").encode()


def _vector_table(entries: list[dict[str, Any]]) -> Iterator[str]:
    """Yield the vectors by group: name, number of planes, what it tests."""
    group = ""
    for entry in entries:
        if entry["group"] != group:
            group = entry["group"]
            yield from ("", f"{group.upper()}")
        name = entry["stream"].removesuffix(".fba")
        notes = " [visage]" * (entry["bap_steps"] == "visage") + " [optional]" * ("optional" in entry)
        yield f"  {name:38} {entry['planes']:5}  {entry['tests']}{notes}"
        if "optional" in entry:
            yield f"  {'':38} {'':5}  ({entry['optional']})"
