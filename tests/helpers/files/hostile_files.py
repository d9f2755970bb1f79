"""Files that try a reader's patience: each grows with a size, and doing so must cost no more than that.

`hostile_files` returns them by name. Each is as long as asked, within a small factor, and repeats one thing
that a reader might search again and again, or unpack: tokens, names, nodes, brackets, quotes, skipped frames.
"""

import io
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import fba
from fba.audio import SoundFile
from fba.body import BodyDefinition, BodyModel
from fba.capture.bones import match
from fba.capture.markers._motion import MarkerMotion
from fba.codec import encode_planes
from fba.face import FaceModel
from fba.face.importers._gltf import gltf_pieces
from fba.face.importers._mesh import polygon_pieces, read_materials
from fba.face.importers.points.points_file import read_points
from fba.formats import format_of
from fba.formats.epf.epf import read_epf
from fba.mesh._obj import read_obj
from fba.mesh._ply import read_ply
from fba.mesh._vrml import read_vrml
from fba.mesh._wfm import read_wfm
from fba.persona import Persona
from fba_player._mesh.textures import load_picture
from format_files import mask
from gltf_documents import Sheet
from mp4_files import Track, box, fragmented_file, numbers, whole_file
from tools.captures.face_files import datagram, face_weights, livelink_csv
from tools.captures.marker_files import c3d, qualisys, trc

JOINTS = {
    "Spine": ("Hips", (0, 1, 0)),
    "Neck": ("Spine", (0, 3, 0)),
    "Head": ("Neck", (0, 1, 0)),
    "LeftUpLeg": ("Hips", (1, 0, 0)),
    "LeftLeg": ("LeftUpLeg", (0, -4, 0)),
    "LeftFoot": ("LeftLeg", (0, -4, 0)),
    "RightUpLeg": ("Hips", (-1, 0, 0)),
    "RightLeg": ("RightUpLeg", (0, -4, 0)),
    "RightFoot": ("RightLeg", (0, -4, 0)),
}
"""Parents and offsets of a skeleton that can be retargeted."""


def joint_lines(parent: str = "Hips") -> str:
    """Return the joints below one as BVH, without channels."""
    return "".join(
        f"JOINT {name} {{ OFFSET {x} {y} {z} CHANNELS 0 {joint_lines(name)}}}\n"
        for name, (above, (x, y, z)) in JOINTS.items()
        if above == parent
    )


@dataclass(frozen=True)
class HostileFile:
    """A file of a size. read: takes its path. name: of the file. make: returns its bytes for a size in bytes.

    beside: other files, by name, of the same size.
    """

    read: Callable[[Path], object]
    name: str
    make: Callable[[int], bytes]
    beside: dict[str, Callable[[int], bytes]] = field(default_factory=dict)

    def write(self, folder: Path, size: int) -> tuple[Path, int]:
        """Write the file, and those beside it; return its path, and the bytes of all."""
        folder.mkdir(parents=True, exist_ok=True)
        total = 0
        for name, make in {**self.beside, self.name: self.make}.items():
            content = make(size)
            total += len(content)
            (folder / name).write_bytes(content)
        return folder / self.name, total


def repeat(head: str, part: str, tail: str = "", *, most: int = 1 << 30) -> Callable[[int], bytes]:
    """Return a maker of files with one part repeated, at most `most` times; "%d" in it is its number."""

    def make(size: int) -> bytes:
        if "%d" not in part:
            return (head + part * min(size // len(part), most) + tail).encode()
        count = min(size // (len(part) + 3), most)
        return (head + "".join(part % number for number in range(count)) + tail).encode()

    return make


def pairs(head: str, first: str, middle: str, last: str, tail: str = "") -> Callable[[int], bytes]:
    """Return a maker of files with two parts, each repeated as often."""

    def make(size: int) -> bytes:
        count = size // (len(first) + len(last))
        return (head + first * count + middle + last * count + tail).encode()

    return make


def counted(head: str, part: str) -> Callable[[int], bytes]:
    """Return a maker of files with one part repeated, whose number stands for "%d" in the head."""

    def make(size: int) -> bytes:
        return (head % (size // len(part)) + part * (size // len(part))).encode()

    return make


def bvh(*, joints: str = "", channels: int = 3, motion: str = "", ends: str = "") -> str:
    """Return a BVH file of known joints, or of those given."""
    nested = joint_lines() + joints
    names = " ".join(("Zrotation", "Xrotation", "Yrotation")[:channels])
    root = f"HIERARCHY\nROOT Hips\n{{\nOFFSET 0 0 0\nCHANNELS {channels} {names}\n"
    return f"{root}{nested}{ends}}}\nMOTION\n{motion}"


def capture(size: int) -> bytes:
    """A capture of ten joints whose root turns: short lines of many frames."""
    words = " ".join(["0.12"] * (3 * len(JOINTS)))
    lines = [f"0 9 0 {n % 40}.5 0 0 {words}\n" for n in range(size // 148)]
    joints = joint_lines().replace("CHANNELS 0", "CHANNELS 3 Zrotation Xrotation Yrotation")
    names = "Xposition Yposition Zposition Zrotation Xrotation Yrotation"
    head = f"HIERARCHY\nROOT Hips\n{{\nOFFSET 0 0 0\nCHANNELS 6 {names}\n{joints}}}\nMOTION\n"
    return f"{head}Frames: {len(lines)}\nFrame Time: 0.04\n{''.join(lines)}".encode()


def nested_joints(size: int) -> bytes:
    """Joints, each in the one before."""
    count = min(size // 60, 4000)
    opened = "".join(f"JOINT j{n}\n{{\nOFFSET 0 1 0\nCHANNELS 1 Zrotation\n" for n in range(count))
    text = bvh(joints=opened + "}\n" * count, motion="Frames: 1\nFrame Time: 0.04\n")
    return (text + " ".join(["1"] * (count + 3)) + "\n").encode()


FRAMES = "Frames: 1\nFrame Time: 0.04\n"
FAP_HEAD = "2.1 a 25 1\n"


def deflated_picture(size: int) -> bytes:
    """A PNG of zeros: its pixels are a thousand times its bytes."""
    side = int((size * 1000 / 3) ** 0.5)
    return png(side, side)


def png(width: int, height: int) -> bytes:
    """A PNG of black pixels in RGB."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    packer = zlib.compressobj(9)
    row = bytes(1 + 3 * width)
    packed = b"".join(packer.compress(row) for _ in range(height)) + packer.flush()
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", packed) + chunk(b"IEND", b"")


def skeleton(
    *,
    nodes: int = 0,
    nested: bool = False,
    name: str = "j%d",
    last: float = 1.0,
    channels: int = 1,
    clips: int = 1,
    skin: bool = False,
    roots: int = 0,
) -> bytes:
    """Return a .glb with a known skeleton whose root turns, and more nodes below its last joint."""
    sheet = Sheet()
    count = len(JOINTS) + 1
    numbers = {known: n for n, known in enumerate(["Hips", *JOINTS])}
    body: list[dict[str, Any]] = [{"name": "Hips"}]
    body += [{"name": known, "translation": offset} for known, (_, offset) in JOINTS.items()]
    for known, (above, _) in JOINTS.items():
        body[numbers[above]].setdefault("children", []).append(numbers[known])
    extra = [{"name": name % n if "%d" in name else name, "translation": [0, 1, 0]} for n in range(nodes)]
    if nodes:
        body[0]["children"] = body[0]["children"] + ([count] if nested else list(range(count, count + nodes)))
    if nested:
        for n in range(nodes - 1):
            extra[n]["children"] = [count + n + 1]
    body += extra
    first = len(body)
    body += [{"name": f"root{n}"} for n in range(roots)]
    times = sheet.array([[0.0], [last]])
    turns = sheet.array([[0, 0, 0, 1], [0.6, 0, 0, 0.8]])
    sampler = {"input": times, "output": turns}
    clip = {
        "samplers": [sampler],
        "channels": [
            {"sampler": 0, "target": {"node": n % first, "path": "rotation"}} for n in range(channels)
        ],
    }
    sheet.json |= {
        "nodes": body,
        "scenes": [{"nodes": [0, *range(first, first + roots)]}],
        "animations": [clip] * clips,
    }
    if skin:
        sheet.json["skins"] = [{"joints": list(range(first))}]
    return sheet.glb()


def surface(*, meshes: int = 1, name: str = "", targets: int = 0, picture: bytes = b"") -> bytes:
    """Return a .glb with as many nodes that show one triangle."""
    sheet = Sheet()
    primitive = sheet.triangle()
    if targets:
        moved = sheet.array([[0, 0, 1]] * 3)
        primitive["targets"] = [{"POSITION": moved}] * targets
    if picture:
        sheet.json |= {
            "images": [{"bufferView": sheet.bytes(picture), "mimeType": "image/png"}],
            "textures": [{"source": 0}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        }
        primitive["material"] = 0
        primitive["attributes"]["TEXCOORD_0"] = sheet.array([[0, 0], [1, 0], [0, 1]])
    sheet.json |= {
        "meshes": [{"primitives": [primitive]}],
        "nodes": [{"mesh": 0} | ({"name": name} if name else {}) for _ in range(meshes)],
    }
    return sheet.glb()


PLY_HEAD = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face %d\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n"
)
OBJ_HEAD = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
VRML_HEAD = "#VRML V2.0 utf8\n"
VRML_SET = (
    "Shape { geometry IndexedFaceSet {"
    " coord Coordinate { point [0 0 0, 1 0 0, 0 1 0] } coordIndex [0 1 2 -1] } }\n"
)
XFACE, XFACE_END = "<xfdp><head/><source/>", "</xfdp>"
XFACE_POINT = '<fdp name="2.1" affects="a.wrl_0" index="0">'
EPF_PLANE = f"FBM 1\nFFR 0\nISI 1\nFMT {'0 ' * 10}\nFQU 1\n"
GLTF = '{"asset": {"version": "2.0"}, '


def wav(rate: int = 8000, channels: int = 1) -> Callable[[int], bytes]:
    """Return a maker of sounds."""

    def make(size: int) -> bytes:
        form = struct.pack("<HHIIHH", 1, channels, rate, rate * channels * 2, channels * 2, 16)
        chunks = b"fmt " + struct.pack("<I", 16) + form + b"data" + struct.pack("<I", size) + bytes(size)
        return b"RIFF" + struct.pack("<I", 4 + len(chunks)) + b"WAVE" + chunks

    return make


def even_vertices(size: int) -> bytes:
    """A binary PLY of faces with lists of different lengths."""
    count = size // 5
    head = PLY_HEAD.replace("ascii", "binary_little_endian") % count
    head = head.partition("end_header\n")[0].replace("list int", "list uchar") + "end_header\n"
    rows = np.zeros((count, 5), dtype=np.uint8)
    rows[::2, 0] = 1
    lists = b"".join(row[: 1 + 4 * row[0]].tobytes() for row in rows)
    return head.encode() + bytes(36) + lists


def read_motion(path: Path) -> object:
    """Read a capture, and find its joints by their names."""
    return match(format_of(path).read_motion(path).names)


def encode_capture(path: Path) -> object:
    """Encode a capture."""
    return fba.encode(fba.read(path), fba.EncoderOptions(clamp=True))


def encode_with_epf(path: Path) -> object:
    """Encode an animation as an EPF file says."""
    return encode_planes(fba.read(path.with_suffix(".fap")), read_epf(path))


def read_pieces(path: Path) -> object:
    """Read an OBJ mesh with its materials, as an import does."""
    return polygon_pieces(read_obj(path), read_materials(path))


def read_picture(path: Path) -> object:
    """Decode the picture of a glTF head."""
    (piece,), _ = gltf_pieces(path)
    return load_picture(piece.part.material.texture).reduced(4)


def read_sound(path: Path) -> object:
    """Read a sound, a second at a time."""
    with SoundFile(path) as sound:
        at = 0
        while len(part := sound.read(at, sound.rate)):
            at += len(part)
    return at


def table(text: str, faces: int) -> Callable[[int], bytes]:
    """Return a maker of wire frames: as many vertices as fit."""

    def make(size: int) -> bytes:
        count = size // len(text)
        return (f"{count}\n" + text * count + f"{faces}\n" + "0 1 2\n" * faces).encode()

    return make


def prefixes(size: int) -> bytes:
    """A capture with many names, each of many words, that begin alike."""
    count = int(size**0.5)
    many = "".join(f"JOINT {'a_' * count}{n} {{ OFFSET 0 1 0 CHANNELS 0 }}\n" for n in range(count // 2))
    return bvh(joints=many, motion=FRAMES + "1 2 3\n").encode()


def planes(size: int) -> bytes:
    """An I plane and P planes that skip a million frames each."""
    return (EPF_PLANE + "SKN 1000000\n" + "FBM 1\nFFR 0\nISI 0\nSKN 1000000\n" * (size // 32)).encode()


def read_markers(path: Path) -> object:
    """Read a capture of markers."""
    return format_of(path).read_face(path, source_rate=Fraction(50))


FAP = FAP_HEAD + mask(3) + "\n0 1\n"


bvh_file = partial(HostileFile, read_motion, "a.bvh")
glb_file = partial(HostileFile, read_motion, "a.glb")
markers_csv = partial(HostileFile, read_markers, "a.csv")
fap_file = partial(HostileFile, fba.read, "a.fap")
glb_head = partial(HostileFile, gltf_pieces, "a.glb")
gltf_head = partial(HostileFile, gltf_pieces, "a.gltf")
face_csv = partial(HostileFile, fba.read, "a.csv")
mp4_file = partial(HostileFile, fba.read, "a.mp4")
fdp_file = partial(HostileFile, read_points, "a.fdp")
points_json = partial(HostileFile, read_points, "a.json")
body_json = partial(HostileFile, BodyDefinition.load, "a.json")
obj_pieces = partial(HostileFile, read_pieces, "a.obj")
vrml_file = partial(HostileFile, read_vrml, "a.wrl")
obj_file = partial(HostileFile, read_obj, "a.obj")
trc_file = partial(HostileFile, read_markers, "a.trc")
ply_file = partial(HostileFile, read_ply, "a.ply")


def hostile_files() -> dict[str, HostileFile]:
    """Return all hostile files, by name."""
    return {
        **_texts(),
        **_captures(),
        **_faces(),
        **_markers(),
        **_gltf(),
        **_meshes(),
        **_points(),
        **_sounds(),
        **_films(),
        **_personas(),
    }


def _texts() -> dict[str, HostileFile]:
    return {
        "fap words": fap_file(repeat(FAP_HEAD + mask(3) + "\n0 ", "1 ")),
        "fap masks": fap_file(repeat(FAP_HEAD, mask(3) + "\n%d 1\n")),
        "fap blanks": fap_file(repeat(FAP_HEAD, "\n")),
        "fap comments": fap_file(repeat(FAP_HEAD, "#\n")),
        "fap returns": fap_file(repeat(FAP_HEAD, "\r")),
        "fap backwards": fap_file(repeat(FAP_HEAD, mask() + "\n0\n")),
        "fap name": fap_file(repeat("2.1 ", "a ", "25 1\n", most=30_000)),
        "fap empty masks": fap_file(repeat(FAP_HEAD, mask() + "\n%d\n")),
        "bap masks": HostileFile(fba.read, "a.bap", repeat("3.1 a 25 1\n", mask(width=186) + "\n%d\n")),
        "epf planes": HostileFile(read_epf, "a.epf", repeat(EPF_PLANE, "FBM 1\nFFR 1\n")),
        "epf I planes": HostileFile(read_epf, "a.epf", repeat("", EPF_PLANE)),
        "epf words": HostileFile(read_epf, "a.epf", repeat("FBM 1\nFIX ", "1 ")),
        "epf skips": HostileFile(encode_with_epf, "a.epf", planes, {"a.fap": lambda size: FAP.encode()}),
    }


def _captures() -> dict[str, HostileFile]:
    joint = " { OFFSET 0 1 0 CHANNELS 0 }\n"
    start = "HIERARCHY\nROOT Hips\n"
    motion = FRAMES + "1 2 3\n"
    ends = bvh(ends="|", motion=motion).split("|")
    names = bvh(joints="JOINT |" + joint, motion=motion).split("|")
    return {
        "bvh nested": bvh_file(nested_joints),
        "bvh capture": HostileFile(encode_capture, "a.bvh", capture),
        "bvh spaces": bvh_file(repeat(bvh() + "Frames", " ", "x\n")),
        "bvh short lines": bvh_file(repeat(bvh(channels=1) + FRAMES, "11\n")),
        "bvh frames": HostileFile(fba.read, "a.bvh", repeat(bvh(channels=1) + FRAMES, "1\n", most=10_000)),
        "bvh one line": bvh_file(repeat(bvh() + FRAMES, "1 ")),
        "bvh blank lines": bvh_file(repeat(bvh() + motion, "\n")),
        "bvh braces": bvh_file(repeat(start, "{")),
        "bvh name": bvh_file(repeat("HIERARCHY\nROOT ", "a ", "{ OFFSET 0 0 0 }\n")),
        "bvh prefixes of a name": bvh_file(repeat(names[0], "a_", names[1])),
        "bvh shared prefixes": bvh_file(prefixes),
        "bvh ends": bvh_file(repeat(ends[0], "End Site { OFFSET 0 1 0 }\n", ends[1])),
        "bvh end words": bvh_file(repeat(start + "{\n", "END ")),
        "bvh joint words": bvh_file(repeat(start + "{\n", "JOINT ")),
        "gltf nodes": glb_file(lambda size: skeleton(nodes=size // 44)),
        "gltf nested": glb_file(lambda size: skeleton(nodes=size // 60, nested=True)),
        "gltf one name": glb_file(lambda size: skeleton(nodes=size // 44, name="Hips")),
        "gltf skin": glb_file(lambda size: skeleton(nodes=size // 52, skin=True)),
        "gltf channels": glb_file(lambda size: skeleton(channels=size // 64)),
        "gltf clips": glb_file(lambda size: skeleton(clips=size // 120)),
        "gltf roots": glb_file(lambda size: skeleton(roots=size // 24)),
        "gltf hours": HostileFile(fba.read, "a.glb", lambda size: skeleton(last=16_000.0)),
    }


RECORD = "jawOpen-1|eyeBlink_L-2|eyeBlink_R-3|mouthLeft-4|mouthClose-5|"
NAMES = '[{"t":-1,"jawOpen":0,"mouthClose":0,"eyeBlinkLeft":0,"eyeBlinkRight":0,"mouthLeft":0},'


def _faces() -> dict[str, HostileFile]:
    def frames(size: int) -> bytes:
        return b"".join(datagram([0.2] * 61, 2 + number / 60) for number in range(size // 320))

    table = livelink_csv(face_weights(2))
    head = table.split("\n", 1)[0]
    few = ",".join(head.split(",")[:8])
    rows = lambda size: livelink_csv(face_weights(size // 680)).encode()  # noqa: E731
    return {
        "packets of a face": HostileFile(
            encode_capture, "a.udp", lambda size: datagram([0.1] * 61, 1.0) + frames(size)
        ),
        "packets without a face": HostileFile(
            fba.read,
            "a.udp",
            lambda size: (
                datagram([0.1] * 61, 0.0)
                + b"".join(datagram(None, 1 + number / 60) for number in range(size // 75))
            ),
        ),
        "records of a face": HostileFile(encode_capture, "a.txt", repeat("", RECORD + "\n")),
        "records, bars": HostileFile(fba.read, "a.txt", repeat(RECORD, "|")),
        "records, names": HostileFile(fba.read, "a.txt", repeat(RECORD, "a%d-1|")),
        "records, small": HostileFile(fba.read, "a.txt", repeat(RECORD, "jawOpen-1\n")),
        "scores, nested": HostileFile(fba.read, "a.json", repeat(NAMES, "[", "]")),
        "scores, lists": HostileFile(fba.read, "a.json", repeat(NAMES, "[],", "0]")),
        "scores, frames": HostileFile(
            encode_capture, "a.json", repeat(NAMES + "0", ',{"t":%d,"jawOpen":0}', "]")
        ),
        "table of a face": HostileFile(encode_capture, "a.csv", rows),
        "table, short rows": face_csv(repeat(few + "\n", "0:0:0:%d" + ",0" * 7 + "\n")),
        "table, names": face_csv(repeat(few, ",a", "\n" + table)),
        "table, blank lines": face_csv(repeat(table, "\n")),
        "table, one line": face_csv(repeat(table, "1,")),
        "table, empty cells": face_csv(repeat(head + "\n", "0:0:0:1" + "," * 53 + "\n")),
    }


def _markers() -> dict[str, HostileFile]:
    def take(markers: int, frames: int) -> MarkerMotion:
        positions = np.full((frames, markers, 3), 0.5)
        return MarkerMotion(
            tuple(f"M{n}a" for n in range(markers)), positions, np.arange(frames) / 50, Fraction(50)
        )

    one = take(1, 1)
    trc_head = trc(one).split(b"\r\n1\t")[0].decode()
    motive = "Format Version,1.23,Length Units,Meters\n\n"
    nexus = "Trajectories\n50\n,,a\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n"
    wide = "time,a_x,a_y,a_z,b_x,b_y,b_z,c_x,c_y,c_z\n"
    return {
        "c3d frames": HostileFile(read_markers, "a.c3d", lambda size: c3d(take(10, size // 160))),
        "c3d markers": HostileFile(read_markers, "a.c3d", lambda size: c3d(take(min(size // 30, 1000), 1))),
        "trc rows": trc_file(repeat(trc_head + "\n", "%d\t\t1\t2\t3\n")),
        "trc names": trc_file(repeat(trc_head[:-8], "\tA", "\n1\t0\n")),
        "trc keys": trc_file(repeat("PathFileType\n", "a ", "\nFrame#\tTime\tA\n1\t0\t1")),
        "motive columns": markers_csv(repeat(motive + ",Type", ",Marker", "\nFrame,X\n")),
        "motive quotes": markers_csv(repeat(motive, '"')),
        "nexus rows": markers_csv(repeat(nexus, "%d,0,1,2,3\n")),
        "nexus sections": markers_csv(repeat(nexus[:-20], "Devices\n1\n\n")),
        "qualisys names": HostileFile(
            read_markers, "a.tsv", lambda size: qualisys(take(max(1, min(size // 20, 1000)), 1))
        ),
        "table of markers": markers_csv(repeat(wide, "%d,1,2,3,4,5,6,7,8,9\n")),
        "table, gaps": markers_csv(repeat(wide, "%d\n")),
        "table, many names": markers_csv(repeat("time,marker,x,y,z\n", "%d,m,1,2,3\n", most=100_000)),
        "table, a name each row": markers_csv(repeat("time,marker,x,y,z\n", "1,n%d,1,2,3\n")),
    }


def _gltf() -> dict[str, HostileFile]:
    return {
        "gltf surfaces": glb_head(lambda size: surface(meshes=size // 12)),
        "gltf heads": glb_head(lambda size: surface(meshes=size // 22, name="head")),
        "gltf targets": glb_head(lambda size: surface(targets=min(size // 16, 4_096))),
        "gltf lists": gltf_head(repeat(GLTF + '"extras": [', "[],", "0]}")),
        "gltf objects": gltf_head(repeat(GLTF + '"extras": [', "{},", "0]}")),
        "gltf meshes": gltf_head(repeat(GLTF + '"meshes": [', '{"primitives":[]},', '{"primitives":[]}]}')),
        "gltf materials": gltf_head(repeat(GLTF + '"materials": [', "{},", "{}]}")),
        "gltf deep": gltf_head(pairs(GLTF + '"extras": ', "[", "", "]", "}")),
        "gltf members": gltf_head(repeat(GLTF, '"a%d":0,', '"b":0}')),
        "gltf digits": gltf_head(repeat(GLTF + '"scene": ', "1", "}")),
        "gltf picture": HostileFile(
            read_picture, "a.glb", lambda size: surface(picture=deflated_picture(size // 5))
        ),
        "face of nothing": HostileFile(FaceModel.load, "a.glb", lambda size: surface(meshes=size // 12)),
        "body of nothing": HostileFile(BodyModel.load, "a.glb", lambda size: skeleton(nodes=size // 44)),
    }


def _meshes() -> dict[str, HostileFile]:
    faces = "f 1 2 3\n"
    return {
        "obj faces": obj_file(repeat(OBJ_HEAD, faces)),
        "obj corners": obj_file(repeat(OBJ_HEAD + "f ", "1 ", "\n", most=500_000)),
        "obj continued": obj_file(repeat(OBJ_HEAD + "f 1 2 3 ", "\\\n", "\n")),
        "obj vertices": obj_file(repeat("", "v 0 0 0\n", faces)),
        "obj groups": obj_pieces(repeat(OBJ_HEAD, "g a%d\n" + faces)),
        "obj materials": obj_pieces(repeat(OBJ_HEAD, "g a\nusemtl m%d\n" + faces)),
        "obj libraries": obj_pieces(
            repeat(OBJ_HEAD + faces, "mtllib a.mtl\n"),
            {"a.mtl": repeat("", "newmtl a%d\n")},
        ),
        "obj pictures": obj_pieces(
            repeat(OBJ_HEAD + "mtllib a.mtl\n", "usemtl a%d\n" + faces, most=1000),
            {
                "a.mtl": repeat("", "newmtl a%d\nmap_Kd a.png\n"),
                "a.png": lambda size: b"\x89PNG" + bytes(size),
            },
        ),
        "obj comments": obj_file(repeat(OBJ_HEAD + faces, "#" * 1000 + "\n")),
        "ply ascii": ply_file(counted(PLY_HEAD, "3 0 1 2\n")),
        "ply empty lists": ply_file(counted(PLY_HEAD, "0\n")),
        "ply binary lists": ply_file(even_vertices),
        "ply words": ply_file(repeat(PLY_HEAD % 1 + "3 0 1 2 ", "1 ")),
        "ply header": ply_file(repeat("ply\n", "comment a\n", "end_header\n")),
        "vrml quotes": vrml_file(repeat(VRML_HEAD + '"', '\\"')),
        "vrml strings": vrml_file(repeat(VRML_HEAD, '"\n')),
        "vrml sets": vrml_file(repeat(VRML_HEAD, VRML_SET)),
        "vrml brackets": vrml_file(repeat(VRML_HEAD, "{")),
        "vrml numbers": vrml_file(repeat(VRML_HEAD + "IndexedFaceSet { coordIndex [", "0 -1 0 -1\n", "] }")),
        "vrml words": vrml_file(repeat(VRML_HEAD, "a\n")),
        "wfm rows": HostileFile(read_wfm, "a.wfm", table("0 0 0\n", 1)),
        "wfm comments": HostileFile(read_wfm, "a.wfm", repeat("", "#\n")),
    }


def _points() -> dict[str, HostileFile]:
    shape = {"a.wrl": lambda size: (VRML_HEAD + VRML_SET).encode()}
    return {
        "points rows": HostileFile(read_points, "a.csv", repeat("name\n", "#\n")),
        "points commas": HostileFile(read_points, "a.csv", repeat("2.1", ",", most=1_000_000)),
        "points blanks": HostileFile(read_points, "a.csv", repeat("2.1", " ", "x", most=1_000_000)),
        "points lists": points_json(repeat('{"2.1": [', "[],", "0]}")),
        "points objects": points_json(repeat('{"2.1": [', "{},", "0]}")),
        "points digits": points_json(repeat('{"2.1": [', "1", ",0,0]}")),
        "points deep": points_json(pairs('{"2.1": ', "[", "", "]", "}")),
        "fdp rows": fdp_file(repeat("1.0 a\n", "99.99 0 0 0\n")),
        "xface elements": fdp_file(repeat(XFACE, "<a/>", XFACE_END)),
        "xface deep": fdp_file(pairs(XFACE, "<a>", "", "</a>", XFACE_END)),
        "xface indices": fdp_file(
            repeat(XFACE + XFACE_POINT + "<indices>", "1 ", "</indices></fdp>" + XFACE_END),
        ),
        "xface influences": fdp_file(
            pairs(
                XFACE + XFACE_POINT + "<indices>",
                "1 2 3 4 5 6 7 8 ",
                "</indices>",
                '<influence fap="3" weight="1"/>',
                "</fdp>" + XFACE_END,
            ),
        ),
        "xface submeshes": fdp_file(
            repeat(XFACE, '<fdp name="2.1" affects="a.wrl_%d" index="0"/>', XFACE_END),
            shape,
        ),
        "xface attributes": fdp_file(repeat("<xfdp ", 'a%d="" ', "/>")),
        "body joints": body_json(repeat('{"joints": {', '"j%d": {"centre": [0, 0, 0]},', '"j": 0}}')),
        "body lists": body_json(repeat('{"joints": [', "[],", "0]}")),
        "body digits": body_json(repeat('{"joints": {"a": {"centre": [', "1", ",0,0]}}}")),
        "body name": body_json(repeat('{"joints": {"', "a", '": {"centre": 0}}}')),
    }


def _films() -> dict[str, HostileFile]:
    plane = b"\0\0\1\xbb\xff"
    return {
        "mp4 samples": mp4_file(lambda size: whole_file(Track([plane] * (size // 30), chunks=(1,)))),
        "mp4 equal samples": mp4_file(equal_samples),
        "mp4 fragments": mp4_file(
            lambda size: fragmented_file(Track([plane] * (size // 120)), range(1, size // 120)),
        ),
        "mp4 boxes": mp4_file(lambda size: whole_file(Track([plane]), padding=box(b"free") * (size // 8))),
        "mp4 tracks": mp4_file(
            lambda size: whole_file(*(Track([plane], number=n) for n in range(size // 560))),
        ),
    }


def equal_samples(size: int) -> bytes:
    """An MP4 file of samples of a byte, whose sizes take no room."""
    count = size // 2
    data = whole_file(Track([b"x" * count], chunks=(1,)))
    for kind, offset, values in ((b"stsz", 8, (1, count)), (b"stts", 12, (count,)), (b"stsc", 16, (count,))):
        at = data.index(kind) + offset
        data = data[:at] + numbers(*values) + data[at + 4 * len(values) :]
    return data


def _sounds() -> dict[str, HostileFile]:
    return {
        "wav": HostileFile(read_sound, "a.wav", wav()),
        "wav of one sample a second": HostileFile(read_sound, "a.wav", wav(rate=1)),
        "wav of 64 channels": HostileFile(read_sound, "a.wav", wav(channels=64)),
    }


def _personas() -> dict[str, HostileFile]:
    return {"persona members": HostileFile(Persona.load, "a.persona", persona_members)}


def persona_members(size: int) -> bytes:
    """A Persona of many small arrays, none of which it needs."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("header.json", '{"kind": "persona", "version": 1}')
        for number in range(size // 300):
            member = io.BytesIO()
            np.save(member, np.zeros(4))
            archive.writestr(f"a{number}.npy", member.getvalue())
    return file.getvalue()
