"""Files for encoders that want a name to write to: they appear whole, or not at all."""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from fba.atomic import check_target, temporary_beside
from fba.errors import FbaError, FormatError

PathLike = str | os.PathLike[str]


@contextlib.contextmanager
def written(path: PathLike) -> Iterator[Path]:
    """The name of a temporary file beside the target: renamed to it if all goes well, removed if not.

    What `fba.atomic` does for those that write to an open file. Raises FormatError where the target cannot
    be written.
    """
    name, mode, direct = check_target(path)
    if direct:
        raise FormatError("is a device or a pipe; give the name of a file to write", path=path)
    target = Path(name)
    with temporary_beside(str(target), target.suffix, path) as (temporary_name, handle):
        os.close(handle)
        temporary = Path(temporary_name)
        yield temporary
        try:
            if mode is not None:
                temporary.chmod(stat.S_IMODE(mode))
            temporary.replace(target)
        except OSError as error:
            raise cannot(path, error) from error


def cannot(path: PathLike, error: BaseException, what: str = "could not be written") -> FbaError:
    """The error to raise where writing failed: in words, with what to do where the disk is full."""
    import errno

    if isinstance(error, FbaError):
        return error
    reason = (error.strerror if isinstance(error, OSError) else None) or str(error) or type(error).__name__
    if getattr(error, "errno", None) in (errno.ENOSPC, errno.EDQUOT):
        reason += "; make room, or write to another disk"
    return FormatError(f"{what}: {reason}", path=path)
