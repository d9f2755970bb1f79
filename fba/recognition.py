"""Guesses of a file's format from its first bytes, for errors of readers that expected another."""

from __future__ import annotations

import re

SIGNATURES: tuple[tuple[bytes, str], ...] = (
    (b"\x89PNG\r\n", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"GIF8", "a GIF picture"),
    (b"\xff\xfe\0\0", "UTF-32 text"),
    (b"\0\0\xfe\xff", "UTF-32 text"),
    (b"\xff\xfe", "UTF-16 text"),
    (b"\xfe\xff", "UTF-16 text"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"\x1f\x8b", "gzip-compressed data"),
    (b"BZh", "bzip2-compressed data"),
    (b"\xfd7zXZ\0", "xz-compressed data"),
    (b"\x28\xb5\x2f\xfd", "zstd-compressed data"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive"),
    (b"OggS", "Ogg sound or video"),
    (b"fLaC", "FLAC sound"),
    (b"ID3", "MP3 sound"),
    (b"\x1aE\xdf\xa3", "Matroska or WebM video"),
    (b"\0\0\1\xba", "an FBA stream"),
    (b"\0\0\1\x01", "an FBA stream"),
    (b"glTF", "binary glTF"),
    (b"Kaydara FBX Binary", "binary FBX"),
    (b"; FBX", "FBX text"),
    (b"BLENDER", "a Blender scene"),
    (b"PXR-USDC", "a USD scene"),
    (b"#usda", "a USD scene"),
    (b"#VRML", "VRML"),
    (b"ply\n", "a PLY mesh"),
    (b"ply\r", "a PLY mesh"),
    (b"PathFileType", "TRC motion capture"),
    (b"\x93NUMPY", "a NumPy array"),
    (b"%PDF", "a PDF document"),
    (b"\x7fELF", "a program"),
    (b"MZ", "a program"),
    (b"#!", "a script"),
    (b"version https://git-lfs", "a Git LFS pointer, which stands for a file that was not downloaded"),
)
RIFF = {b"WAVE": "WAV sound", b"AVI ": "AVI video", b"WEBP": "a WebP picture"}
HEAD_BYTES = 4096
"""Bytes of a file that are enough for recognition."""
EPF_TAGS = ("FBM", "FFR", "BFR", "ISI", "GDR", "CDM")
"""Tags with which EPF files begin."""
MIN_MASK_BITS = 60
"""Least number of bits in a line that counts as a mask."""
MIN_BODY_BITS = 100
"""Least number of bits in a mask of BAPs; a mask of FAPs has fewer."""
OBJ_WORDS = ("v", "vt", "vn", "f", "g", "o", "mtllib", "usemtl", "s")
MIN_CSV_LINES = 3
"""Least number of lines in a table."""


def recognise(head: bytes) -> str:
    """Return a guess of the format of a file with this beginning, such as "a PNG picture", or ""."""
    if not head:
        return ""
    if _is_program_stream(head):
        return "an MPEG program stream (video)"
    for beginning, kind in SIGNATURES:
        if head.startswith(beginning):
            return kind
    if head[:4] == b"RIFF":
        return RIFF.get(head[8:12], "a RIFF file")
    if head[4:8] == b"ftyp":
        return "MP4 or MOV video"
    if head[257:262] == b"ustar":
        return "a tar archive"
    if len(head) > 2 and head[0] in range(2, 8) and head[1] == 0x50:
        return "C3D motion capture"
    if not any(head):
        return "nothing but zero bytes"
    if b"\0" in head:
        wide = len(head) >= 8 and (not any(head[1:64:2]) or not any(head[:64:2]))
        return "UTF-16 text" if wide else "binary data"
    return _recognise_text(head.removeprefix(b"\xef\xbb\xbf").lstrip())


def recognition_hint(head: bytes) -> str:
    """Return the end of an error: "; it seems to be a PNG picture", or "" if that is unknown."""
    kind = recognise(head)
    return f"; it seems to be {kind}" if kind else ""


def _is_program_stream(head: bytes) -> bool:
    """Return whether this is video of MPEG-1 or 2, which begins like an FBA stream; the next bits differ."""
    return head.startswith(b"\0\0\1\xba") and len(head) > 4 and (head[4] >> 6 == 1 or head[4] >> 4 == 2)


def _recognise_text(head: bytes) -> str:
    """Return a guess of the format of a text file."""
    if head.startswith(b"{"):
        return "glTF" if b'"asset"' in head else "JSON"
    start = head[:2000].lower()
    if start.startswith((b"<!doctype html", b"<html")):
        return "a web page (HTML)"
    if start.startswith(b"<"):
        return "COLLADA" if b"<collada" in start else "XML"
    if re.match(rb"hierarchy\s+root\b", start):
        return "BVH motion capture"
    if re.match(rb":version|#!oml:asf", start):
        return "ASF motion capture"
    text = head.decode("latin-1")
    lines = [line for line in (line.partition("#")[0].strip() for line in text.splitlines()) if line]
    return (_recognise_lines(lines) or _recognise_table(lines)) if lines else ""


def _recognise_lines(lines: list[str]) -> str:
    """Recognise FAP, BAP, EPF and OBJ files by their first lines."""
    if lines[0].split()[0] in EPF_TAGS:
        return "an EPF file (encoder parameters)"
    for line in lines[:2]:
        words = line.split()
        if len(words) >= MIN_MASK_BITS and set(words) <= {"0", "1"}:
            return "a BAP file" if len(words) >= MIN_BODY_BITS else "a FAP file"
    obj_lines = sum(line.split()[0] in OBJ_WORDS for line in lines)
    return "an OBJ mesh" if obj_lines > max(len(lines) // 2, 2) else ""


def _recognise_table(lines: list[str]) -> str:
    """Recognise a table by a separator that occurs equally often in each of the first lines."""
    rows = lines[:10]
    if len(rows) < MIN_CSV_LINES:
        return ""
    for separator in (",", ";", "\t"):
        counts = {row.count(separator) for row in rows}
        if len(counts) == 1 and counts != {0}:
            return "a table (CSV)"
    return ""
