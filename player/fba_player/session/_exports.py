"""The export of a session that is under way, and the programs that ask for the names of files."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from fba.atomic import PathLike
from fba.errors import FbaError

if TYPE_CHECKING:
    from fba_player.export._background import Export, ExportOptions
    from fba_player.view.protocols import Showable

UNSAVED_EXPORT = "an export that is not finished"
"""What closing the window would lose."""
DIALOGS = ("zenity", "kdialog", "matedialog", "qarma")
"""Programs that show file dialogs on Linux."""
NO_DIALOGS = (
    "Type a name: no program for file dialogs is installed here (Debian, Ubuntu: apt-get install zenity). "
    "Files dropped onto the window are opened, too"
)


def has_dialogs() -> bool:
    """Return whether this machine can show file dialogs: Linux needs a program for them."""
    return sys.platform != "linux" or any(shutil.which(name) for name in DIALOGS)


class Exports:
    """The export of a scene: one at a time, in another process.

    say, rolling, unsaved: those of the session.
    """

    def __init__(
        self, scene: Showable, say: Callable[..., None], rolling: set[str], unsaved: set[str]
    ) -> None:
        self._scene, self._say, self._rolling, self._unsaved = scene, say, rolling, unsaved
        self.now: Export | None = None

    def begin(self, path: PathLike, options: ExportOptions, *, replace: bool = False) -> bool:
        """Begin to export the scene; return whether it began, else say why not.

        replace: whether a file of that name may be overwritten.
        """
        from fba_player.export._background import Export

        if self.now is not None:
            self._say("An export is under way; cancel it, or wait for its end", "warning")
            return False
        if not replace and os.path.lexists(path):
            self._say(f"{os.fspath(path)} exists already; give another name", "warning", about="export")
            return False
        try:
            self.now = Export(self._scene, path, options)
        except (FbaError, OSError, ValueError) as error:
            self._say(f"Cannot be exported: {error}", "error", 8.0)
            return False
        self._rolling.add("export")
        self._unsaved.add(UNSAVED_EXPORT)
        return True

    def poll(self) -> None:
        """Note how far it is, and say when it is finished; call before each picture."""
        export = self.now
        if export is None:
            return
        export.poll()
        if not export.finished:
            return
        cancelled = export.cancelled
        self.close()
        if cancelled:
            self._say("The export was cancelled; no file is left")
        elif export.problem:
            self._say(f"Export failed: {export.problem}", "error", 10.0)
        else:
            self._say(f"Saved as {export.path}", seconds=8.0)
            for note in export.notes[:2]:
                self._say(note, "warning", 8.0)

    def cancel(self) -> None:
        """Let it stop, without a file, while the window goes on; `poll` says when it has."""
        if self.now is not None:
            self.now.cancel()

    def close(self) -> None:
        """Stop it, without a file, and wait for its end."""
        export, self.now = self.now, None
        self._rolling.discard("export")
        self._unsaved.discard(UNSAVED_EXPORT)
        if export is not None:
            export.close()
