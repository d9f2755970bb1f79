"""Creates OpenGL contexts, with errors that say what to install."""

from __future__ import annotations

from typing import Any

from fba.errors import DisplayError
from fba_player.gl.system_libraries import OPENGL, cure, how_to_install, missing_libraries, missing_text

GL_VERSION = 330


def import_moderngl() -> Any:
    """The moderngl module. Raises DisplayError if it cannot be imported."""
    try:
        import moderngl
    except ImportError as error:
        raise DisplayError(
            f"pictures need the Python package moderngl, which cannot be imported: {error}. "
            + cure(error, "moderngl")
        ) from error
    return moderngl


def offscreen_context() -> Any:
    """A moderngl context that needs no display, through EGL or the platform's default.

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


def _short(error: BaseException) -> str:
    return " ".join(str(error).split())[:160] or type(error).__name__
