"""Members of ZIP archives, within the limits of memory; all damage is a FormatError."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Iterator

from fba.errors import FbaError, FormatError
from fba.limits import Limits
from fba.source import Path

ZIP = b"PK\x03\x04"
"""First bytes of an archive."""
MOST_MEMBERS = 10_000


def read_members(
    data: bytes, path: Path, limits: Limits, wanted: Callable[[str], bool]
) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of the wanted members of an archive.

    Raises FormatError for damage, and for what is encrypted or compressed in ways that are not supported;
    LimitError for a member that is larger than the limits allow.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            if len(members) > MOST_MEMBERS:
                raise FormatError(f"holds {len(members)} files; expected {MOST_MEMBERS} at most", path=path)
            for member in members:
                if wanted(member.filename):
                    limits.check_bytes(member.file_size, f"{path}: {member.filename}", source=len(data))
                    yield member.filename, archive.read(member)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, OSError, ValueError) as error:
        if isinstance(error, FbaError):
            raise
        raise FormatError(f"is no archive that can be read: {error}", path=path) from error
    except Exception as error:  # zlib.error and the like have no common class
        if type(error).__module__ in ("zlib", "lzma", "_lzma"):
            raise FormatError(f"is damaged: {error}", path=path) from error
        raise
