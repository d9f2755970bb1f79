"""The corpus: small files of every kind, one folder a target, that mutations start from.

`tools/make_fuzz_corpus.py` makes it. Where a folder has no streams, they are made here.
"""

from __future__ import annotations

from pathlib import Path

from fba.errors import OptionError
from tools.fuzz.small_streams import doubtful_marks, long_streams, small_streams
from tools.fuzz.targets import Target

CHECKOUT = Path(__file__).parents[2] / "tests" / "fuzz" / "corpus"


def read_corpus(target: Target, folder: Path | None = None) -> list[bytes]:
    """Return the files of a target in the order of their names; those of all targets for "any".

    folder: with one folder for each target; by default that of the checkout. Raises OptionError if there are
    no files. A target of random inputs has one, of zeros.
    """
    if target.random:
        return [bytes(8)]
    folder = CHECKOUT if folder is None else folder
    patterns = (
        ["*/*"]
        if target.folder == "any"
        else [f"{name}/*" for name in (target.folder, target.besides) if name]
    )
    paths = [path for pattern in patterns for path in sorted(folder.glob(pattern))]
    files = [path.read_bytes() for path in paths if path.is_file()]
    if not files and target.folder == "stream":
        files = [*small_streams().values(), *doubtful_marks().values(), *long_streams().values()]
    if not files:
        raise OptionError(
            f"{folder / target.folder}: no files to mutate here; `python tools/make_fuzz_corpus.py` in a "
            "checkout makes them, or name another folder with --corpus"
        )
    return files
