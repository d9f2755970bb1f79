"""Writes captures of markers in the formats that programs export, as their makers lay them out."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fba.capture import MarkerMotion

BLOCK = 512
PROCESSORS = {"intel": 84, "dec": 85, "mips": 86}


def c3d(
    motion: MarkerMotion,
    *,
    processor: str = "intel",
    integers: bool = False,
    unit: str = "mm",
    analogue: int = 0,
    subject: str = "",
    units: Sequence[str] = (),
    computed: Sequence[str] = (),
    long_frames: bool = False,
    rate: float | None = None,
) -> bytes:
    """A C3D file. units: one for each marker; computed: labels that the file lists as angles."""
    order = ">" if processor == "mips" else "<"
    count, frames = len(motion.names), len(motion)
    size = {"mm": 1000.0, "m": 1.0, "cm": 100.0}
    factors = np.array([size[u] for u in units] if units else [size[unit]] * count)
    values = motion.positions * factors[:, None]
    seen = motion.seen
    scale = 0.05 if integers else 1.0
    values = np.where(seen[..., None], values, 0.0)

    def real(*numbers: float) -> bytes:
        raw = np.array(numbers, dtype=np.float64)
        if processor != "dec":
            return raw.astype(f"{order}f4").tobytes()
        halves = (raw * 4).astype("<f4").view("<u2").reshape(-1, 2)
        return np.ascontiguousarray(halves[:, ::-1]).tobytes()

    def word(*numbers: int) -> bytes:
        return b"".join(struct.pack(f"{order}H", number & 0xFFFF) for number in numbers)

    def entry(group: int, name: str, body: bytes, *, last: bool = False) -> bytes:
        rest = body + b"\0"
        return struct.pack("bb", len(name), group) + name.encode() + word(0 if last else len(rest) + 2) + rest

    def text(group: int, name: str, texts: Sequence[str]) -> bytes:
        width = max((len(t) for t in texts), default=1)
        body = struct.pack("bBBB", -1, 2, width, len(texts)) + b"".join(
            t.encode().ljust(width) for t in texts
        )
        return entry(group, name, body)

    labels = [f"{subject}:{name}" if subject else name for name in motion.names]
    section_blocks = 1 + (2 * count * max(map(len, labels)) + 4 * len(units) + 300) // BLOCK
    parameters = b""
    for number, name in ((1, "POINT"), (2, "TRIAL")):
        parameters += struct.pack("bb", len(name), -number) + name.encode() + word(3) + b"\0"
    for start in range(0, count, 255):
        suffix = "" if not start else str(start // 255 + 1)
        parameters += text(1, f"LABELS{suffix}", labels[start : start + 255])
    parameters += text(1, "UNITS", list(units) or [unit])
    if computed:
        parameters += text(1, "ANGLES", computed)
    parameters += entry(1, "USED", struct.pack("bB", 2, 0) + word(count))
    parameters += entry(1, "SCALE", struct.pack("bB", 4, 0) + real(scale if integers else -1.0))
    own_rate = float(motion.rate) if rate is None else rate
    parameters += entry(1, "RATE", struct.pack("bB", 4, 0) + real(own_rate))
    parameters += entry(1, "DATA_START", struct.pack("bB", 2, 0) + word(2 + section_blocks))
    stored = struct.pack("bB", 4, 0) + real(frames) if long_frames else struct.pack("bB", 2, 0) + word(frames)
    parameters += entry(1, "FRAMES", stored)
    parameters += text(1, "Y_SCREEN", [motion.up.upper() or "+Z"])
    blocks = section_blocks
    section = bytes([1, 0x50, blocks, PROCESSORS[processor]]) + parameters
    header = bytes([2, 0x50]) + word(count, analogue, 1, 0xFFFF if long_frames else frames, 0)
    header += real(scale if integers else -1.0) + word(2 + blocks, 1 if analogue else 0)
    header += real(own_rate)
    columns = 4 * count + analogue
    table = np.zeros((frames, columns))
    points = table[:, : 4 * count].reshape(frames, count, 4)
    points[..., :3] = np.rint(values / scale) if integers else values
    points[..., 3] = np.where(seen, 0, -1)
    data = table.astype(f"{order}i2").tobytes() if integers else real(*table.ravel())
    return (
        header.ljust(BLOCK, b"\0")
        + section.ljust(blocks * BLOCK, b"\0")
        + data.ljust(-(-len(data) // BLOCK) * BLOCK, b"\0")
    )


def _rows(motion: MarkerMotion, scale: float, delimiter: str, missing: str = "") -> list[str]:
    flat = (motion.positions * scale).reshape(len(motion), -1)
    return [
        delimiter.join(missing if np.isnan(number) else f"{number:.6f}" for number in row) for row in flat
    ]


def trc(motion: MarkerMotion, *, layout: str = "usual", delimiter: str = "\t", unit: str = "mm") -> bytes:
    """A TRC file. layout: "usual", "tight" (no empty line or cells), or "axes" (columns name_x)."""
    d, count, rate = delimiter, len(motion.names), f"{float(motion.rate):g}"
    lines = [
        d.join(["PathFileType", "4", "(X/Y/Z)", "a.trc"]),
        d.join(
            [
                "DataRate",
                "CameraRate",
                "NumFrames",
                "NumMarkers",
                "Units",
                "OrigDataRate",
                "OrigDataStartFrame",
                "OrigNumFrames",
            ]
        ),
        d.join([rate, rate, str(len(motion)), str(count), unit, rate, "1", str(len(motion))]),
    ]
    if layout == "axes":
        lines.append(d.join(["Frame#", "Time", *(f"{n}_{axis}" for n in motion.names for axis in "xyz")]))
    elif layout == "tight":
        lines.append(d.join(["Frame#", "Time", *motion.names]))
        lines.append(d.join(["", "", *(f"{axis}{n + 1}" for n in range(count) for axis in "XYZ")]))
    else:
        lines.append(d.join(["Frame#", "Time", *(cell for n in motion.names for cell in (n, "", ""))]))
        lines += [d.join(["", "", *(f"{axis}{n + 1}" for n in range(count) for axis in "XYZ")]), ""]
    scale = {"mm": 1000.0, "m": 1.0}[unit]
    for n, row in enumerate(_rows(motion, scale, d)):
        lines.append(f"{n + 1}{d}{motion.times[n]:.3f}{d}{row}")
    return ("\r\n".join(lines) + "\r\n").encode()


def motive(
    motion: MarkerMotion, *, version: str = "1.23", unit: str = "Centimeters", code: bool = False
) -> bytes:
    """A CSV export of Motive, with a rigid body and a marker without a label beside the markers."""
    scale = {"Centimeters": 100.0, "Millimeters": 1000.0, "Meters": 1.0}[unit]
    rate = f"{float(motion.rate):f}"
    lead = ["", ""] if version == "1.2" else ["", "{}"]
    pads = [""] if code else []
    names = [f"Actor:{name}" for name in motion.names]
    body = ["Rigid Body"] * 7
    rows = [
        ("Type", body + ["Marker"] * (3 * len(names) + 3)),
        ("Name", ["Cap"] * 7 + [f'"{n}"' for name in (*names, "Unlabeled 1189") for n in [name] * 3]),
        ("ID", ["1"] * 7 + [str(n + 2) for n in range(len(names) + 1) for _ in range(3)]),
        ("", ["Rotation"] * 4 + ["Position"] * 3 + ["Position"] * (3 * len(names) + 3)),
    ]  # fmt: skip
    lines = [
        f"Format Version,{version},Take Name,smile,Capture Frame Rate,{rate},Export Frame Rate,{rate},"
        f"Rotation Type,Quaternion,Length Units,{unit},Coordinate Space,Global",
        "",
        *(",".join([*(cell.format(label) for cell in lead), *pads, *cells]) for label, cells in rows),
    ]
    columns = ["Frame", "Time (Seconds)", *(["TimeCode"] if code else []), *"XYZWXYZ", *(3 * list("X"))][:-3]
    lines.append(",".join([*columns, *("XYZ" * (len(names) + 1))]))
    for n, row in enumerate(_rows(motion, scale, ",")):
        stamp = [f"15:26:46:{n:02d}.02"] if code else []
        lines.append(",".join([str(n), f"{motion.times[n]:.6f}", *stamp, *"0001123", row, ",,"]))
    return ("\n".join(lines) + "\n").encode()


def nexus(motion: MarkerMotion) -> bytes:
    """A CSV export of Nexus with a section before the trajectories and one after them."""
    names = ",".join(f"Anna:{name},," for name in motion.names)
    count = len(motion.names)
    lines = [
        "Devices", "1000", ",,Force", "Frame,Sub Frame,Fx", ",,N", "1,0,3.5", "",
        "Trajectories", f"{float(motion.rate):g}", f",,{names}", "Frame,Sub Frame," + ",".join("XYZ" * count),
        ",," + ",".join(["mm"] * (3 * count)),
    ]  # fmt: skip
    lines += [f"{n + 7},0,{row}" for n, row in enumerate(_rows(motion, 1000.0, ","))]
    return (
        "\n".join([*lines, "", "Model Outputs", "100", ",,Anna:Angle", "Frame,Sub Frame,X", ",,deg", "7,0,1"])
        + "\n"
    ).encode()


def qualisys(motion: MarkerMotion, *, columns: bool = False) -> bytes:
    """A TSV export of Qualisys Track Manager. columns: with a header row, frames and times."""
    names = "\t".join(motion.names)
    lines = [
        f"NO_OF_FRAMES\t{len(motion)}", "NO_OF_CAMERAS\t8", f"NO_OF_MARKERS\t{len(motion.names)}",
        f"FREQUENCY\t{float(motion.rate):g}", "NO_OF_ANALOG\t0", "ANALOG_FREQUENCY\t0", "DESCRIPTION\t--",
        "TIME_STAMP\t2020-01-01, 12:00:00.000\t1.5", "DATA_INCLUDED\t3D", f"MARKER_NAMES\t{names}",
    ]  # fmt: skip
    rows = _rows(motion, 1000.0, "\t", "0.000")
    if columns:
        heads = "\t".join(f"{name} {axis}" for name in motion.names for axis in "XYZ")
        lines.append(f"Frame\tTime\t{heads}")
        rows = [f"{n + 1}\t{motion.times[n]:.5f}\t{row}" for n, row in enumerate(rows)]
    return ("\r\n".join([*lines, *rows]) + "\r\n").encode()


def wide(motion: MarkerMotion, *, delimiter: str = ",", comma: bool = False, unit: str = "") -> bytes:
    """A table with a column for each coordinate. comma: as the decimal mark."""
    note = f" ({unit})" if unit else ""
    heads = [f"{name}_{axis}{note}" for name in motion.names for axis in "xyz"]
    lines = [delimiter.join(["frame", "time", *heads])]
    scale = {"mm": 1000.0}.get(unit, 1.0)
    for n, row in enumerate(_rows(motion, scale, delimiter)):
        line = f"{n}{delimiter}{motion.times[n]:.4f}{delimiter}{row}"
        lines.append(line.replace(".", ",") if comma else line)
    return ("\n".join(lines) + "\n").encode()


def long(motion: MarkerMotion) -> bytes:
    """A table with a row for each marker seen in a frame."""
    lines = ["frame,time,marker,x,y,z"]
    for n, frame in enumerate(motion.positions):
        for name, place in zip(motion.names, frame, strict=True):
            if not np.isnan(place).any():
                lines.append(f"{n},{motion.times[n]:.4f},{name}," + ",".join(f"{v:.6f}" for v in place))
    return ("\n".join(lines) + "\n").encode()


MAKERS = {
    "float.c3d": c3d,
    "integers.c3d": lambda motion: c3d(motion, integers=True),
    "dec.c3d": lambda motion: c3d(motion, processor="dec"),
    "dec_integers.c3d": lambda motion: c3d(motion, processor="dec", integers=True),
    "mips.c3d": lambda motion: c3d(motion, processor="mips", analogue=2),
    "mips_integers.c3d": lambda motion: c3d(motion, processor="mips", integers=True, subject="Anna"),
    "metres.c3d": lambda motion: c3d(motion, unit="m"),
    "many_frames.c3d": lambda motion: c3d(motion, long_frames=True),
    "usual.trc": trc,
    "tight.trc": lambda motion: trc(motion, layout="tight", unit="m"),
    "axes.trc": lambda motion: trc(motion, layout="axes"),
    "commas.trc": lambda motion: trc(motion, delimiter=","),
    "motive.csv": motive,
    "motive_old.csv": lambda motion: motive(motion, version="1.2", unit="Meters"),
    "motive_code.csv": lambda motion: motive(motion, version="1.25", unit="Millimeters", code=True),
    "nexus.csv": nexus,
    "qualisys.tsv": qualisys,
    "qualisys_columns.tsv": lambda motion: qualisys(motion, columns=True),
    "wide.csv": wide,
    "wide_comma.csv": lambda motion: wide(motion, delimiter=";", comma=True, unit="mm"),
    "long.csv": long,
}
"""Files by name: each holds a motion in one way of one maker."""


def write(folder: Path, name: str, motion: MarkerMotion) -> Path:
    """Write a motion as one of `MAKERS`; return the file."""
    path = folder / name
    path.write_bytes(MAKERS[name](motion))
    return path
