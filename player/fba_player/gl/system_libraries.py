"""The system libraries that OpenGL needs on Linux: which are missing, and how to install them."""

from __future__ import annotations

import ctypes
import re
import sys
from collections.abc import Iterable

PACKAGES = {
    "libEGL.so.1": ("libegl1", "mesa-libEGL"),
    "libGL.so.1": ("libgl1", "mesa-libGL mesa-dri-drivers"),
    "libX11.so.6": ("libx11-6", "libX11"),
}
"""Libraries, and the packages that contain them: in Debian and Ubuntu, and in Fedora."""
OPENGL = ("libEGL.so.1", "libGL.so.1")
"""The libraries that pictures without a window need."""


def missing_libraries(names: Iterable[str] = OPENGL) -> list[str]:
    """Those of the named libraries that cannot be loaded; none on other systems than Linux."""
    if not sys.platform.startswith("linux"):
        return []
    missing = []
    for name in names:
        try:
            ctypes.CDLL(name)
        except OSError:
            missing.append(name)
    return missing


def how_to_install(names: Iterable[str]) -> str:
    """A sentence with the commands that install these libraries, which must be in `PACKAGES`."""
    debian, fedora = zip(*(PACKAGES[name] for name in names), strict=True)
    return (
        f"Install with: sudo apt-get install {' '.join(debian)} (Debian, Ubuntu), "
        f"or: sudo dnf install {' '.join(fedora)} (Fedora)"
    )


def missing_text(names: Iterable[str]) -> str:
    """One sentence that names missing libraries, and one with the commands that install them."""
    names = list(names)
    kind = "library" if len(names) == 1 else "libraries"
    return f"the system {kind} {' and '.join(names)} cannot be loaded. {how_to_install(names)}"


def cure(error: Exception, package: str) -> str:
    """What to install against an error of an import: the library that it names, else the Python package."""
    found = re.match(r"(lib\S+): cannot open shared object file", str(error))
    if found is None:
        return f"Install it with: pip install {package}"
    if found[1] in PACKAGES:
        return how_to_install([found[1]])
    return f"Install the system library {found[1]}"
