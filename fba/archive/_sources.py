"""The files of folders that hold animations, with their names, subjects and labels."""

from __future__ import annotations

import csv
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath

from fba.archive._locations import Location, RemotePath
from fba.errors import FormatError, ModelError, OptionError, did_you_mean
from fba.formats import formats
from fba.text_files import read_lines

SOUNDS = (".wav", ".flac", ".ogg", ".opus", ".mp3", ".m4a", ".aac")
"""Suffixes of sound files, the one that is taken first, first."""
MOST_FILES = 10_000_000


@dataclass(frozen=True)
class Source:
    """A file with an animation.

    shown: its path below the folder, with slashes. name: the same without the suffix, unless two files have
    it. sound_name: the sound file beside it, below the folder; sound: its path.
    """

    path: Location
    shown: str
    name: str
    subject: str | None = None
    labels: Mapping[str, str] = field(default_factory=dict)
    sound_name: str | None = None
    sound: Location | None = None


def find_sources(folders: Sequence[Location], *, leave_out: Sequence[Path] = ()) -> list[Source]:
    """Return the files in folders, and below them, whose suffix is that of a format that is read; by name.

    folders: or files; a folder elsewhere is a `RemotePath`. With several, names begin with that of the
    folder. Hidden files and folders are left out, and so are links to folders, and the files `leave_out`.
    Raises FormatError for a folder that cannot be listed, and if two files have the same name.
    """
    suffixes = {suffix for each in formats() if each.carries for suffix in each.suffixes}
    left_out = {os.path.realpath(path) for path in leave_out}
    found: list[Source] = []
    for folder in folders:
        if isinstance(folder, RemotePath):
            found += _find_elsewhere(folder, suffixes, f"{folder.name}/" if len(folders) > 1 else "")
            continue
        prefix = f"{folder.resolve().name}/" if len(folders) > 1 and folder.is_dir() else ""
        root = folder if folder.is_dir() else folder.parent
        files = sorted(_files(folder)) if folder.is_dir() else [folder]
        for path in files:
            if path.suffix.lower() not in suffixes or os.path.realpath(path) in left_out:
                continue
            shown = prefix + path.relative_to(root).as_posix()
            sound = _sound(path)
            sound_name = None if sound is None else prefix + sound.relative_to(root).as_posix()
            name = shown[: len(shown) - len(path.suffix)]
            found.append(Source(path, shown, name, sound=sound, sound_name=sound_name))
            if len(found) > MOST_FILES:
                raise FormatError(f"holds more than {MOST_FILES} files; give parts of it", path=folder)
    names = Counter(one.name for one in found)
    found = [one if names[one.name] == 1 else replace(one, name=one.shown) for one in found]
    twice = [name for name, count in Counter(one.name for one in found).items() if count > 1]
    if twice:
        raise FormatError(f"{twice[0]} is there twice: two of the given folders have the same name and files")
    return sorted(found, key=lambda one: one.name)


def _find_elsewhere(folder: RemotePath, suffixes: set[str], prefix: str) -> list[Source]:
    """Return the files in and below a folder elsewhere."""
    names = [name for name in folder.walk() if not any(part.startswith(".") for part in name.split("/"))]
    if len(names) > MOST_FILES:
        raise FormatError(f"holds more than {MOST_FILES} files; give parts of it", path=folder)
    present = set(names)
    found = []
    for name in sorted(names):
        path = PurePosixPath(name)
        if path.suffix.lower() in suffixes:
            beside = (path.with_suffix(suffix).as_posix() for suffix in SOUNDS)
            sound = next((one for one in beside if one in present), None)
            found.append(
                Source(
                    folder / name, prefix + name, prefix + path.with_suffix("").as_posix(),
                    sound=None if sound is None else folder / sound,
                    sound_name=None if sound is None else prefix + sound,
                )
            )  # fmt: skip
    return found


def _files(folder: Path) -> Iterator[Path]:
    """Yield the regular files in and below a folder."""
    try:
        for entry in os.scandir(folder):
            if entry.name.startswith("."):
                continue
            if entry.is_dir(follow_symlinks=False):
                yield from _files(Path(entry.path))
            elif entry.is_file():
                yield Path(entry.path)
    except OSError as error:
        raise FormatError(f"cannot be listed: {error.strerror or error}", path=folder) from error


def _sound(path: Path) -> Path | None:
    return next((sound for suffix in SOUNDS if (sound := path.with_suffix(suffix)).is_file()), None)


def label_by_folders(sources: Sequence[Source], levels: Sequence[str]) -> list[Source]:
    """Return sources with labels from the folders that they lie in.

    levels: what the folders are, from the top: ("subject", "emotion") of anna/joy/take1.fba.
    """
    labelled = []
    for source in sources:
        found = dict(zip(levels, source.shown.split("/")[:-1], strict=False))
        subject = found.pop("subject", source.subject)
        labelled.append(replace(source, subject=subject, labels={**source.labels, **found}))
    return labelled


def label_by_table(sources: Sequence[Source], table: Path) -> list[Source]:
    """Return sources with labels from a CSV table.

    Its first line names the columns: `file`, the path or the name of a source, `subject`, and others, whose
    cells become labels; empty cells do not. Raises FormatError for a table without the column `file`, for a
    file that is named twice, and for one that is not there.
    """
    rows = _read_table(table)
    by_name = {name: position for position, one in enumerate(sources) for name in (one.name, one.shown)}
    labelled = list(sources)
    seen: dict[int, int] = {}
    for line, row in rows:
        name = row.pop("file").strip().replace("\\", "/")
        at = by_name.get(name)
        if at is None:
            near = did_you_mean(name, by_name)
            raise FormatError(f"names a file that is not there{near}", path=table, line=line, token=name)
        if at in seen:
            raise FormatError(f"names a file that line {seen[at]} names", path=table, line=line, token=name)
        seen[at] = line
        given = {column: cell.strip() for column, cell in row.items() if cell and cell.strip()}
        subject = given.pop("subject", labelled[at].subject)
        labelled[at] = replace(labelled[at], subject=subject, labels={**labelled[at].labels, **given})
    return labelled


def _read_table(table: Path) -> list[tuple[int, dict[str, str]]]:
    """Return the lines of a table with their numbers, as cells by column."""
    try:
        lines = list(read_lines(table))
    except ModelError as error:
        raise FormatError(error.finding.removeprefix(f"{table}: "), path=table) from error
    reader = csv.reader(text for _, text in lines)
    columns = [column.strip() for column in next(reader, [])]
    if "file" not in columns:
        listed = ", ".join(columns) or "nothing"
        raise FormatError(f"has no column `file`; its first line has {listed}", path=table, line=1)
    if len(set(columns)) < len(columns):
        raise FormatError("two of its columns have the same name", path=table, line=1)
    rows = []
    for cells in reader:
        if any(cell.strip() for cell in cells):
            if len(cells) != len(columns):
                raise FormatError(
                    f"has {len(cells)} cells; the first line names {len(columns)} columns", path=table,
                    line=reader.line_num,
                )  # fmt: skip
            rows.append((reader.line_num, dict(zip(columns, cells, strict=True))))
    return rows


def check_levels(text: str) -> tuple[str, ...]:
    """Return the names of levels of folders, from "subject,emotion". Raises OptionError for empty or equal
    ones."""
    levels = tuple(level.strip() for level in text.split(","))
    if not all(levels) or len(set(levels)) < len(levels):
        raise OptionError(f"{text!r}: name the levels of folders, each once, as in subject,emotion")
    return levels
