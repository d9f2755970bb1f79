"""OpenGL contexts, and the system libraries that they need on Linux; errors say what to install."""

from __future__ import annotations

import ctypes
import re
import sys
from collections.abc import Iterable
from typing import Any

from fba.errors import DisplayError

GL_VERSION = 330
PACKAGES = {
    "libEGL.so.1": ("libegl1", "mesa-libEGL"),
    "libGL.so.1": ("libgl1", "mesa-libGL mesa-dri-drivers"),
    "libX11.so.6": ("libx11-6", "libX11"),
}
"""Libraries, and the packages that contain them: in Debian and Ubuntu, and in Fedora."""
SOFTWARE = ("llvmpipe", "softpipe", "swiftshader", "swrast", "software", "basic render")
"""Parts of the names of drivers that draw without a graphics card."""
OPENGL = ("libEGL.so.1", "libGL.so.1")
"""The libraries that pictures without a window need."""


def import_moderngl() -> Any:
    """Return the moderngl module. Raises DisplayError if it cannot be imported."""
    try:
        import moderngl
    except ImportError as error:
        raise DisplayError(
            f"pictures need the Python package moderngl, which cannot be imported: {error}. "
            + cure(error, "moderngl")
        ) from error
    return moderngl


def offscreen_context() -> Any:
    """Return a moderngl context that needs no display, through EGL or the platform's default.

    Raises DisplayError without OpenGL 3.3; the message says what to install.
    """
    moderngl = import_moderngl()
    reasons = []
    for options in ({"backend": "egl"}, {}):
        try:
            return moderngl.create_context(standalone=True, require=GL_VERSION, **options)
        except Exception as error:
            reasons.append(f"{options.get('backend', 'default')}: {_short(error)}")
    missing = missing_libraries()
    if missing:
        raise DisplayError(f"pictures need OpenGL, but {missing_text(missing)}")
    text = "; ".join(reasons)
    if "not found" in text or "cannot open shared object" in text or "not loaded" in text:
        raise DisplayError(f"OpenGL cannot be loaded: {text}. {how_to_install(OPENGL)}")
    raise DisplayError(
        f"no OpenGL 3.3 context could be made ({text}). Install libegl1 and libgl1 with a driver "
        "(Debian, Ubuntu: apt-get install libegl1 libgl1 libgl1-mesa-dri), or update the graphics driver; "
        "where the variable DISPLAY names a display that is not there, unset it: none is needed"
    )


def is_software(context: Any) -> bool:
    """Return whether the processor draws what a moderngl context draws, as its driver says."""
    driver = context.info["GL_RENDERER"].lower()
    return any(name in driver for name in SOFTWARE)


def missing_libraries(names: Iterable[str] = OPENGL) -> list[str]:
    """Return those of the named libraries that cannot be loaded; none on systems other than Linux."""
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
    """Return a sentence with the commands that install these libraries, which must be in `PACKAGES`."""
    debian, fedora = zip(*(PACKAGES[name] for name in names), strict=True)
    return (
        f"Install with: sudo apt-get install {' '.join(debian)} (Debian, Ubuntu), "
        f"or: sudo dnf install {' '.join(fedora)} (Fedora)"
    )


def missing_text(names: Iterable[str]) -> str:
    """Return one sentence that names missing libraries, and one with the commands that install them."""
    names = list(names)
    kind = "library" if len(names) == 1 else "libraries"
    return f"the system {kind} {' and '.join(names)} cannot be loaded. {how_to_install(names)}"


def cure(error: Exception, package: str) -> str:
    """Return what to install against an error of an import: the library that it names, else the package.

    package: of Python, or this one with the extra that brings it: "mpeg4-fba[films]".
    """
    library = re.match(r"(lib\S+): cannot open shared object file", str(error))
    if library is None:
        quoted = f'"{package}"' if "[" in package else package  # shells read brackets as a pattern
        return f"Install it with: pip install {quoted}"
    if library[1] in PACKAGES:
        return how_to_install([library[1]])
    return f"Install the system library {library[1]}"


def _short(error: BaseException) -> str:
    return " ".join(str(error).split())[:160] or type(error).__name__
