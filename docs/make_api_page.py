"""Makes docs/api.md, the public names of the library: `python docs/make_api_page.py`."""

from __future__ import annotations

import inspect
import re
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

PAGE = Path(__file__).parent / "api.md"
ROOMS = (
    "fba", "fba.formats", "fba.codec", "fba.carriage.mp4", "fba.planning", "fba.planning.rate",
    "fba.parameters",
    "fba.face", "fba.face.importers", "fba.face.authoring", "fba.face.calibration", "fba.face.checks",
    "fba.face.learning", "fba.body", "fba.body.gait", "fba.capture", "fba.capture.markers",
    "fba.capture.points", "fba.capture.virtual_markers", "fba.emotion", "fba.persona", "fba.live",
    "fba.player", "fba.serving", "fba.archive",
)  # fmt: skip
"""Packages and modules whose `__all__` users may rely on."""
START = """# Public names

What is listed here is public. All else may change without notice, above all modules and names that begin
with an underscore. [library.md](library.md) shows how the names are used, and the documentation site has
their signatures. `python docs/make_api_page.py` makes this page from `__all__` of the rooms.
"""


def main() -> None:
    """Write the page."""
    PAGE.write_text(make_page(), encoding="utf-8")


def make_page() -> str:
    """Return the page as Markdown: a section a room, a row a name."""
    return START + "".join(_section(name) for name in ROOMS)


def _section(name: str) -> str:
    module = import_module(name)
    rows = [_row(module, public) for public in module.__all__ if f"{name}.{public}" not in ROOMS]
    head = f"\n## {name}\n\n{_first_sentence(module)}\n\n| name | what it is |\n|---|---|\n"
    return head + "".join(row for row in rows if row)


def _row(module: Any, name: str) -> str:
    value = getattr(module, name)
    if inspect.ismodule(value):
        return ""
    if get_origin(value) is not None:
        parts = (value,) if get_origin(value) is Literal else get_args(value)
        choices = [repr(text) for one in parts for text in get_args(one)]
        choices += [one.__name__ for one in parts if not get_args(one)]
        return f"| `{name}` | type: {', '.join(f'`{choice}`' for choice in choices)} |\n"
    if inspect.isclass(value):
        kind = "exception" if issubclass(value, BaseException) else "class"
    elif callable(value):
        kind = "function"
    else:
        return f"| `{name}` | constant |\n"
    return f"| `{name}` | {kind}: {_first_sentence(value)} |\n"


def _first_sentence(value: Any) -> str:
    paragraph = (inspect.getdoc(value) or "").partition("\n\n")[0].replace("\n", " ")
    return re.split(r"(?<=[.;])\s", paragraph)[0].rstrip(".:;").replace("|", "\\|") + "."


if __name__ == "__main__":
    main()
