"""What windows remember from one time to the next: files that were shown, hints that were read."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

from fba.atomic import PathLike, atomic
from fba.errors import FbaError

NAME = "window.json"
MOST_RECENT = 8
"""Most files that are remembered."""
MOST_BYTES = 1 << 16
"""Bytes; a larger file is no such file."""


class Memory:
    """A small file in the user's folder for settings; without one, nothing is remembered.

    folder: by default that named by FBA_CONFIG, else the system's. A file that cannot be read counts as
    empty; one that cannot be written is left as it is.
    """

    def __init__(self, folder: PathLike | None = None) -> None:
        chosen = _folder() if folder is None else Path(folder)
        self._path = None if chosen is None else chosen / NAME
        self._content = self._read()

    @property
    def recent(self) -> list[Path]:
        """Files that were shown, the newest first."""
        names = self._content.get("recent")
        names = names if isinstance(names, list) else []
        return [Path(name) for name in names if isinstance(name, str)][:MOST_RECENT]

    @property
    def welcomed(self) -> bool:
        """Whether the user has read the hints of the first window."""
        return self._content.get("welcomed") is True

    def add(self, path: PathLike) -> None:
        """Remember a file that is shown."""
        whole = Path(path).absolute()
        others = [other for other in self.recent if other != whole]
        self._write("recent", [str(one) for one in [whole, *others][:MOST_RECENT]])

    def welcome(self) -> None:
        """Remember that the hints were read."""
        self._write("welcomed", True)

    def _read(self) -> dict[str, Any]:
        try:
            if self._path is None or self._path.stat().st_size > MOST_BYTES:
                return {}
            content = json.loads(self._path.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            return {}
        return content if isinstance(content, dict) else {}

    def _write(self, name: str, value: object) -> None:
        self._content = {**self._read(), name: value}  # another window may have written meanwhile
        if self._path is None:
            return
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with atomic(self._path) as file:
                file.write(json.dumps(self._content, indent=1).encode())
        except (OSError, FbaError):
            return


def _folder() -> Path | None:
    """Return the user's folder for settings; None if there is no home folder."""
    named = os.environ.get("FBA_CONFIG")
    try:
        if named:
            return Path(named)
        if sys.platform == "win32":
            return Path(os.environ.get("APPDATA") or Path.home() / "AppData" / "Roaming") / "fba"
        if sys.platform == "darwin":
            return Path.home() / "Library" / "Application Support" / "fba"
        return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "fba"
    except RuntimeError:
        return None
