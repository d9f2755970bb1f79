"""Make the corpus of the fuzzer: small files of every kind that is read, from nothing but what stands here.

python tools/make_fuzz_corpus.py [FOLDER]
"""

from __future__ import annotations

import base64
import io
import json
import sys
import zipfile
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

ROOT = Path(__file__).parents[1]
CORPUS = ROOT / "tests" / "fuzz" / "corpus"
sys.path[:0] = [str(ROOT / "tests" / "helpers" / folder) for folder in ("", "files", "figures")]

import avatar_files  # noqa: E402
from fba.arrays import Float64  # noqa: E402
from fba.cache import load_or_make  # noqa: E402
from fba.capture import MarkerMotion  # noqa: E402
from fba.carriage.mp4 import split_samples, write_mp4  # noqa: E402
from fba.carriage.rtp import write_frame  # noqa: E402
from fba.carriage.sdp import Session, write_sdp  # noqa: E402
from fba.carriage.sending import DatagramWriter  # noqa: E402
from fba.face import FaceModel, feature_point_names, neutral_points  # noqa: E402
from fba.formats import read_motion  # noqa: E402
from fba.live import KINDS  # noqa: E402
from fba.outlines import View  # noqa: E402
from fba.outlines._index_file import Stored, Stream, pack_mask, write_index  # noqa: E402
from fba.persona import learn  # noqa: E402
from fba.serving import Plane  # noqa: E402
from gltf_documents import Sheet  # noqa: E402
from live_senders import vmc_frames, vtube_objects  # noqa: E402
from mesh_files import ply  # noqa: E402
from mp4_files import Track, esds, fragmented_file, whole_file  # noqa: E402
from rtp_network import PERIOD, packets_of, planes_of, stream  # noqa: E402
from small_bodies import rod  # noqa: E402
from small_people import write_person  # noqa: E402
from stored_models import face  # noqa: E402
from tools.captures import marker_files, point_files  # noqa: E402
from tools.captures.face_files import (  # noqa: E402
    beat,
    face_angles,
    face_weights,
    ifacialmocap_records,
    livelink_csv,
    livelink_udp,
    mediapipe_frames,
    openface_csv,
    pyfeat_csv,
)
from tools.captures.tracked_actor import film  # noqa: E402
from tools.fuzz._packets import CONNECTION, DATAGRAMS, DESCRIPTION, RTP  # noqa: E402
from tools.fuzz._small_head import (  # noqa: E402
    small_head,
    small_head_fdp,
    small_head_obj,
    small_head_wfm,
    small_head_xface,
)
from tools.fuzz.small_streams import doubtful_marks, long_streams, small_streams  # noqa: E402
from tools.persona.actors import act  # noqa: E402


def mask(*numbers: int, width: int = 68) -> str:
    """Return a mask line with these parameters (from 1) sent."""
    return " ".join("1" if column + 1 in numbers else "0" for column in range(width))


BODY = {
    "Hips": ("", 0, 97, -5), "Spine": ("Hips", 0, 11, 0), "Spine1": ("Spine", 0, 13, 0),
    "Neck": ("Spine1", 0, 33, 5), "Head": ("Neck", 0, 11, 2),
    "LeftArm": ("Spine1", 19, 25, 0), "LeftForeArm": ("LeftArm", 30, 0, 0), "LeftHand": ("LeftForeArm", 27,
    0, 0),
    "RightArm": ("Spine1", -19, 25, 0), "RightForeArm": ("RightArm", -30, 0, 0),
    "RightHand": ("RightForeArm", -27, 0, 0),
    "LeftUpLeg": ("Hips", 9, -4, 0), "LeftLeg": ("LeftUpLeg", 0, -43, 0), "LeftFoot": ("LeftLeg", 0, -43, -2),
    "LeftToeBase": ("LeftFoot", 0, -7, 13),
    "RightUpLeg": ("Hips", -9, -4, 0), "RightLeg": ("RightUpLeg", 0, -43, 0), "RightFoot": ("RightLeg", 0,
    -43, -2),
    "RightToeBase": ("RightFoot", 0, -7, 13),
}  # fmt: skip
"""Joints of a plain body: the joint above, and the way from it in centimetres."""


def bvh(
    names: dict[str, tuple[str, float, float, float]],
    frames: int,
    rotation: str = "Zrotation Xrotation Yrotation",
) -> bytes:
    """Return a BVH file of these joints."""
    lines = ["HIERARCHY"]
    channels = 0

    def add(name: str) -> None:
        nonlocal channels
        parent, *offset = names[name]
        moved = "" if parent else "Xposition Yposition Zposition "
        count = len((moved + rotation).split())
        channels += count
        lines.append(f"{'JOINT' if parent else 'ROOT'} {name}\n{{\nOFFSET {' '.join(map(str, offset))}")
        lines.append(f"CHANNELS {count} {moved}{rotation}")
        below = [one for one, (above, *_) in names.items() if above == name]
        for one in below:
            add(one)
        if not below:
            lines.append("End Site\n{\nOFFSET 0 5 0\n}")
        lines.append("}")

    add(next(iter(names)))
    lines.append(f"MOTION\nFrames: {frames}\nFrame Time: 0.0333333")
    lines += [
        " ".join(str((7 * frame + 3 * channel) % 40 - 20) for channel in range(channels))
        for frame in range(frames)
    ]
    return "\n".join([*lines, ""]).encode()


def skeleton(**changes: object) -> Sheet:
    """Return a glTF document with the body's joints, a skin and an animation of three joints."""
    sheet = Sheet()
    names = list(BODY)
    nodes: list[dict[str, object]] = [
        {"name": name, "translation": [value / 100 for value in BODY[name][1:]]} for name in names
    ]
    for name in names:
        below = [names.index(one) for one in names if BODY[one][0] == name]
        if below:
            nodes[names.index(name)]["children"] = below
    times = sheet.array([0.0, 0.04, 0.08])
    turned = [(0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.6, 0.8), (0.0, 0.0, 1.0, 0.0)]
    rotations = sheet.array(turned)
    moves = sheet.array([(0.0, 1.0, 0.0), (0.1, 1.0, 0.0), (0.2, 1.0, 0.1)])
    spline = sheet.array([row for one in turned for row in ((0.0,) * 4, one, (0.0,) * 4)])
    samplers = [
        {"input": times, "output": rotations, "interpolation": "LINEAR"},
        {"input": times, "output": moves, "interpolation": "STEP"},
        {"input": times, "output": spline, "interpolation": "CUBICSPLINE"},
    ]
    channels = [
        {"sampler": 0, "target": {"node": names.index("LeftArm"), "path": "rotation"}},
        {"sampler": 1, "target": {"node": 0, "path": "translation"}},
        {"sampler": 2, "target": {"node": names.index("RightLeg"), "path": "rotation"}},
    ]
    sheet.json |= {
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes,
        "skins": [{"joints": list(range(len(names)))}],
        "animations": [{"name": "wave", "samplers": samplers, "channels": channels}],
    }  # fmt: skip
    sheet.json |= changes
    return sheet


def as_text(sheet: Sheet) -> bytes:
    """Return a document as .gltf, its bytes in it as base64."""
    uri = "data:application/octet-stream;base64," + base64.b64encode(sheet.data).decode()
    buffers = [{"byteLength": len(sheet.data), "uri": uri}]
    return json.dumps(sheet.json | {"buffers": buffers}, indent=0).encode()


def textured() -> Sheet:
    """Return a document with a mesh, a sparse accessor, a material and a morph target."""
    sheet = Sheet()
    primitive = sheet.triangle(material=0)
    sparse = {
        "count": 1,
        "indices": {"bufferView": sheet.bytes(b"\1\0"), "componentType": 5123},
        "values": {"bufferView": sheet.bytes(np.array([0, 0, 1], "<f4").tobytes())},
    }
    sheet.json["accessors"].append({"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse})
    primitive["targets"] = [{"POSITION": len(sheet.json["accessors"]) - 1}]
    primitive["attributes"]["TEXCOORD_0"] = sheet.array([(0, 0), (255, 0), (0, 255)], "u1", normalized=True)
    sheet.json["materials"] = [{"name": "red", "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}]
    return sheet.show(primitive, matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1, 0, 1])


FAPS = {
    "numbers": ["# c", "2.1 a b 25 3", mask(1, 2, 3, 50), "0 1 2 3 1 1 2 3 4 1 0 77 -5", mask(3), "1 5.5",
    mask(3, 68), "3 5 6", ""],
    "short": ["2.2 a 29.97 1", mask(48), "0 -1024", ""],
}  # fmt: skip
BAPS = {
    "bits186": ["3.1 a 25 2", mask(1, 186, width=186), "0 1 -2", mask(7, width=296), "4 5", ""],
    "bits296": ["3.2 a 30000/1001 1", mask(181, 200, width=296), "0 100000 7", ""],
}
EPFS = {
    "all_tags": [
        "FBM 3", "FFR 0", "BFR 0", "ISI 1", "FRR 25 0 0", "TC 0 0 1 0", "SKN 3",
        "FMT 0 3 0 0 1 1 0 0 0 0 0 0 2 1 0 0 0 0",
        "FQU 1", "FIX " + "60 " * 66, "BMT 0 0 0 0 0 1 1 1 0 0 1" + " 0" * 18, "BQU 2",
        "BIN " + "-61 " * 296, "GDR 1",
        "FBM 1", "FFR 1", "ISI 0", "",
    ],
    "one_plane": ["FBM 1", "FFR 0", "ISI 1", "FMT 3" + " 0" * 9, "FQU 3", ""],
}  # fmt: skip
OBJ = """# c
mtllib a.mtl
o one
g skin
usemtl flesh
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v 0 1 0 0 0 1
v 1 1 0.5
vt 0 0
vt 1 0
vt 0 1
vn 0 0 1
f 1/1/1 2/2/1 3/3/1
f -1//1 -2//1 \\
  -3//1
f 1 2 4 3
"""
MAPPING = """\
[head]
name = "head.obj"
vertices = 9
triangles = 8
connectivity = "00ff"
shape = "ff00"

[settings]
assignment = "exclusive"
overlap = "add"
scale = ["A", "B"]

[virtual_markers]
"A" = { vertex = 1, radius = 0.5, depth = 1e-3, fixed = true }
"B" = { vertex = 2, radius = 2, fixed = true }
"Cap" = { fixed = true }
"Chin: low" = { vertex = 3, radius = 0.25 }
"Lip" = { vertex = 4, radius = 0.25, follows = "Chin: low", share = 0.5 }
"""
MTL = "newmtl flesh\nKd 0.7 0.4 0.3\nNs 20\nd 0.9\nmap_Kd -s 1 1 1 skin.png\nnewmtl eye\nKd 1 1 1\nTr 0.5\n"
VRML = """#VRML V2.0 utf8
DEF one Shape { geometry IndexedFaceSet {
  coord Coordinate { point [ 0 0 0, 10 0 0, # a comment
    0 10 5 ] } coordIndex [ 0, 1, 2, -1 ]
  texCoord TextureCoordinate { point [ 0 0, 1 1 ] } } }
Transform { translation 1 2 3 children [ USE one
  Shape { appearance Appearance { material Material { diffuseColor 1 0 0 }
  texture ImageTexture { url "a#b\\".png" } }
  geometry IndexedFaceSet { coord Coordinate { point [ 3 1 2, 4 1 2, 3 2 2, 4 2 2 ] }
  coordIndex [ 0 1 3 2 ] } } ] }
"""
WFM = """# VERTEX LIST:
4
0 0 0
1 0 0
0 1 0
0 0 1
# FACE LIST:
2
0 1 2
1 2 3
# ANIMATION UNITS LIST:
0
# END OF FILE
"""
XFACE = """<?xml version="1.0"?><xfdp><head><file version="0.2"/>
<fapu ENS0="51" ES0="69" IRISD0="16" MNS0="30" MW0="50"/></head>
<source><entity alias="Rest" category="Expression"><mesh file="head.wrl" format="wrl"/>
<bind item="LeftEye" submesh="head.wrl_1"/></entity></source>
<fdp affects="head.wrl_0" index="2" name="9.3"><indices>0 1 2</indices>
<influence fap="62" type="RaisedCosInfluenceSph" weight="0.3"/></fdp>
<fdp affects="head.wrl_1" index="0" name="3.5"><indices/></fdp></xfdp>
"""
FDP = "1.0 a\n2.1 0 -0.08 0.03 0.5\n3.5 0.03 0.03 0.02 1.2\n3.6 -0.03 0.03 0.02 2.2\nNUL 3\n9.3 0 0 0.1\n"
CSV = 'point,x,y,z\n# c\n"9.3",0,-0.5,1e1\n\n2.1,17\n'
JSON = '{"points": {"9.3": [0, -0.5, 10.0], "2.1": 17, "3.5": [1, 2, 3]}}\n'


def lines(files: dict[str, list[str]]) -> dict[str, bytes]:
    """Return files of these lines."""
    return {name: "\n".join(content).encode() for name, content in files.items()}


def meshes() -> dict[str, bytes]:
    """Return one PLY file of each form."""
    places, faces = np.eye(4, 3), [(0, 1, 2), (0, 1, 2, 3)]
    return {
        "ascii": ply(places, faces, "ascii", extra=True),
        "little": ply(places, faces, "<"),
        "big": ply(places, faces, ">", extra=True),
    }


def small_heads() -> dict[str, bytes]:
    """Return the small head as one PLY file of each form."""
    vertices, triangles = [], []
    for part_vertices, part_triangles in small_head().values():
        triangles += [tuple(len(vertices) + n for n in triangle) for triangle in part_triangles]
        vertices += part_vertices.round(4).tolist()
    forms = {"ascii": "ascii", "little": "<", "big": ">"}
    return {f"ply_{name}": ply(np.array(vertices), triangles, form) for name, form in forms.items()}


def looking(folder: Path) -> bytes:
    """Return a VRM animation: a head that nods, and a gaze that goes aside."""
    path = folder / "look.vrma"
    turns = [Rotation.from_euler("X", [angle], degrees=True) for angle in (0.0, 10.0, 0.0)]
    gaze = [Rotation.from_euler("Y", [angle], degrees=True) for angle in (0.0, 20.0, -20.0)]
    write_person(path, clips={"look": {"head": turns}}, extension="VRMC_vrm_animation", gaze=gaze)
    return path.read_bytes()


def stored(path: Path) -> bytes:
    """Return an archive with its members stored, so that mutations reach what they hold."""
    data = io.BytesIO()
    with zipfile.ZipFile(path) as packed, zipfile.ZipFile(data, "w", zipfile.ZIP_STORED) as archive:
        for member in packed.infolist():
            info = zipfile.ZipInfo(member.filename, member.date_time)
            info.create_system = 3  # Unix, everywhere
            archive.writestr(info, packed.read(member))
    return data.getvalue()


def outlines(folder: Path) -> bytes:
    """Return an index of two poses of a performance, each seen from two sides as a square."""
    mask = np.zeros((100, 100), dtype=bool)
    mask[20:80, 30:70] = True
    steps = np.arange(4 * 64 * 3, dtype=np.float32).reshape(4, 64, 3) / 1024
    path = folder / "a.outlines"
    write_index(
        path,
        Stored(
            (Stream("walk", Fraction(25), (True,) * 68, (False,) * 296),),
            (View(0.0, 0.0), View(90.0, 0.0)),
            np.zeros((2, 68), np.int32), np.zeros((2, 296), np.int32), np.arange(2), np.arange(2),
            np.zeros(2, np.int32), np.stack([pack_mask(mask)] * 4), steps,
        ),
    )  # fmt: skip
    return stored(path)


def persona(folder: Path) -> bytes:
    """Return a Persona of an actor who smiles, its members stored, so that mutations reach what they hold.

    All is rounded to eighths of a millimetre, so that every machine makes the same.
    """
    path = folder / "a.persona"
    learnt = learn([act([("E_HAPPY", 0.9)], seed=1, name="actor").face])
    parts = {
        name: replace(part, moved=_rounded(part.moved),
                      curves=replace(part.curves, moved=_rounded(part.curves.moved)))
        for name, part in learnt.parts.items()
    }  # fmt: skip
    replace(learnt, neutral=_rounded(learnt.neutral), parts=parts).save(path)
    return stored(path)


def _rounded(values: Float64) -> Float64:
    return (8 * values).round() / 8


def pyfeat_2() -> bytes:
    """Return a table as py-feat 2 writes it: a box, a pose, blendshapes and the time of each frame."""
    weights = {name: rows[:3] for name, rows in face_weights(3).items() if name != "tongueOut"}
    columns = {
        "FaceRectX": [200.0] * 3, "FaceScore": [0.9] * 3, "Pitch": [0.0, 0.1, 0.2], "Yaw": [0.1, 0.0, -0.1],
        "Roll": [0.0] * 3, "AU12": [0.5] * 3, "_neutral": [0.0] * 3, **weights, "frame": [0.0, 1.0, 2.0],
    }  # fmt: skip
    lines = [",".join(columns) + ",approx_time"]
    lines += [",".join(f"{values[row]:g}" for values in columns.values()) + ",00:00" for row in range(3)]
    return "\n".join([*lines, ""]).encode()


def small_head_gltf() -> bytes:
    """Return the small head as a glTF document, a node for each part."""
    sheet = Sheet()
    sheet.json |= {"meshes": [], "nodes": []}
    for name, (vertices, triangles) in small_head().items():
        position = sheet.array(vertices.round(4))
        indices = sheet.array(np.ravel(triangles), "u2")
        sheet.json["meshes"].append(
            {"name": name, "primitives": [{"attributes": {"POSITION": position}, "indices": indices}]}
        )
        sheet.json["nodes"].append({"name": name, "mesh": len(sheet.json["meshes"]) - 1})
    sheet.json["scenes"] = [{"nodes": list(range(len(sheet.json["nodes"])))}]
    return sheet.glb()


def saved(folder: Path) -> dict[str, dict[str, bytes]]:
    """Return models and cached arrays as the program saves them."""
    face().save(folder / "face.glb")
    rod().save(folder / "body.glb")
    import os

    os.environ["FBA_CACHE"] = str(folder)
    arrays = [np.arange(24, dtype=np.float32).reshape(4, 6), np.arange(5, dtype=np.float32)]
    load_or_make("fuzz", ((4, 6), (5,)), lambda: arrays, np.float32)
    return {
        "face": {"face": (folder / "face.glb").read_bytes()},
        "body": {"body": (folder / "body.glb").read_bytes()},
        "cache": {"arrays": (folder / "fba" / "fuzz.fbk").read_bytes()},
    }


def faces() -> dict[str, bytes]:
    """Return captures of a face, in all formats."""
    weights = face_weights(4)
    few = dict(list(weights.items())[:20])
    turns = np.full((4, 6), 5.0)
    return {
        "livelink": livelink_csv(few).encode(),
        "datagrams": b"".join(livelink_udp({**weights, **face_angles(4)})[:3]),
        "records": "\n".join(ifacialmocap_records(few, turns, turns)).encode(),
        "mediapipe": json.dumps(mediapipe_frames(few)).encode(),
        "openface": openface_csv(
            {12: np.arange(4.0), 26: np.ones(4)}, np.zeros((4, 3)), np.ones((4, 6))
        ).encode(),
        "pyfeat": pyfeat_csv({one: np.ones(3) / 2 for one in range(1, 7)}, frames=np.arange(3.0)).encode(),
        "pyfeat_2": pyfeat_2(),
        "beat": json.dumps(beat(few)).encode(),
        **tracked(),
    }


def tracked() -> dict[str, bytes]:
    """Return points of tracked faces: iBUG's 68, in a table, in JSON and in arrays."""
    motion = film(FaceModel.default(), 68, frames=3, flat=True).motion
    small = replace(motion, positions=motion.positions.round())
    kinds = ("wide.csv", "long.csv", "headless.csv", "lists.json", "points.npz", "points.npy")
    found = {f"points-{kind}": point_files.LAYOUTS[kind](small) for kind in kinds}
    return {**found, "points-openpose": point_files.lines(point_files.openpose_frames(small))}


def live() -> dict[str, bytes]:
    """Return live captures: a byte for the kind, then datagrams behind an address and a length."""
    weights, rows = face_weights(4), np.zeros((4, 6))
    still = np.tile([0.0, 0.0, 0.0, 1.0], (4, 1))
    sent = {
        "livelink": livelink_udp({**weights, **face_angles(4)}),
        "ifacialmocap": [record.encode() for record in ifacialmocap_records(weights, rows, rows, version=2)],
        "vtube": vtube_objects(weights, rows[:, :3]),
        "vmc": [one for _, _, one in vmc_frames({"LeftUpperArm": still}, {"A": still[:, 3]}, 4, split=40)],
    }
    kinds = [kind.name for kind in KINDS]
    return {
        name: bytes([kinds.index(name)])
        + b"".join(b"\0" + len(one).to_bytes(2, "big") + one for one in parts)
        for name, parts in sent.items()
    }


def packets() -> dict[str, bytes]:
    """Return streams in packets: a byte for the kind, then packets behind a sender and a length."""
    planes = planes_of(stream(12, replace(PERIOD, intra_period=0.2)))
    body = planes_of(stream(3, PERIOD, body=True), body=True)
    long = bytes([0x31]) + bytes(range(1, 250)) * 12  # no plane, but of more than one packet
    part = Plane(long, 0.5, 25.0, units=(long,))
    sent = {
        "sizes": (RTP, packets_of(planes, planes_per_packet=3)),
        "codes": (RTP, packets_of(planes, kind="6416")),
        "body": (RTP, packets_of([*body, part], kind="6416")),
        "parts": (RTP, packets_of([*planes[:2], part, *planes[3:]])),
    }
    writer = DatagramWriter(2)
    bare = [(0.0, one) for plane in planes for one in writer.push(plane, 0.0)]
    joined = b"".join(write_frame(data) for _, data in packets_of(planes))
    sent["datagrams"] = DATAGRAMS, bare
    sent["connection"] = CONNECTION, [(0.0, joined[at : at + 100]) for at in range(0, len(joined), 100)]
    session = Session("192.168.0.20", 5004, configuration=bytes.fromhex("000001b061000001b523000001ba"))
    return {
        "description": bytes([DESCRIPTION]) + write_sdp(session).encode(),
        **{
            name: bytes([kind]) + b"".join(b"\0" + len(one).to_bytes(2, "big") + one for _, one in parts)
            for name, (kind, parts) in sent.items()
        },
    }


def markers() -> dict[str, bytes]:
    """Return captures of a face's markers in all formats: a mouth that opens, with one marker lost."""
    points = dict(zip(feature_point_names(), neutral_points(), strict=True))
    named = ("2.1", "2.10", "8.1", "8.2", "8.3", "8.4", "4.1", "4.2", "9.3", "9.12", "9.15", "11.1", "11.2")
    positions = np.array([[points[name] for name in named]] * 3)
    positions[1:, 0, 1] -= 0.01
    positions[1, 7] = np.nan
    motion = MarkerMotion(tuple(f"p{name}" for name in named), positions, np.arange(3) / 25, Fraction(25))
    kinds = ("float.c3d", "mips_integers.c3d", "dec.c3d", "usual.trc", "motive.csv", "nexus.csv")
    kinds += ("qualisys.tsv", "long.csv")
    found = {
        **{kind: marker_files.MAKERS[kind](motion) for kind in kinds},
        "wide.csv": marker_files.wide(motion),
    }
    return {f"markers_{name.replace('.', '_')}": data for name, data in found.items()}


def mp4() -> dict[str, bytes]:
    """Return small MP4 files with streams: those of this program, and with the boxes of others."""
    stream = small_streams()["one_fap"]
    samples = split_samples(stream)
    planes, sync = samples.planes[:4], [1, 3]
    edits, visual = [(40, -1), (0, 1)], esds(samples.configuration, digits=4)
    other = Track(planes, sync=sync, described=visual, sizes="16", wide=True, chunks=(1, 3), edits=edits)
    return {
        "whole": write_mp4(stream),
        "fragments": write_mp4(stream, fragment=0.16),
        "others": whole_file(other, data="rest"),
        "others_compact": whole_file(Track(planes, sizes="8", version=1), data="long", moov_last=True),
        "others_fragments": fragmented_file(Track(planes, sync=sync), [2], base="file", flags="first"),
    }


def smpl() -> dict[str, bytes]:
    """Return motions of SMPL bodies that stand, by one array of poses and by parts, with jaw and eyes."""
    turns = np.zeros((3, 55, 3))
    turns[:, 0, 0] = np.pi / 2
    turns[:, 16, 2], turns[:, 17, 2], turns[:, 18, 1] = -1.2, 1.2, -np.linspace(0, 1, 3)
    turns[:, 22:25] = 0.1
    poses = turns.reshape(3, -1)
    common = {"trans": np.zeros((3, 3)), "mocap_frame_rate": np.array(30.0)}
    parts = {
        "root_orient": poses[:, :3], "pose_body": poses[:, 3:66], "pose_jaw": poses[:, 66:69],
        "pose_eye": poses[:, 69:75],
    }  # fmt: skip
    layouts = {"body": {"poses": poses[:, :156]}, "whole": {"poses": poses}, "parts": parts}
    return {name: point_files.archive({**arrays, **common}) for name, arrays in layouts.items()}


def avatar_units(folder: Path) -> dict[str, bytes]:
    """Return a face, a person in a container, and a stream with names of this project."""
    limb = folder / "limb.bvh"
    limb.write_bytes(bvh({name: BODY[name] for name in ("Hips", "LeftUpLeg", "LeftLeg", "LeftFoot")}, 2))
    rows = [avatar_files.weights(frame, {17: 0.5, 19: 0.25}, flags=128 * frame) for frame in range(2)]
    placed = np.tile(np.eye(4), (3, 1, 1))
    both = b"".join(rows[frame] + avatar_files.joints(frame, placed) for frame in range(2))
    return {
        "face": avatar_files.configuration() + b"".join(rows),
        "person": avatar_files.container(
            folder / "a.arfz", read_motion(limb), seed=0, faces=True
        ).read_bytes(),
        "both": avatar_files.configuration("arkit-face mpeg4-body") + both,
    }


def corpus(folder: Path) -> dict[str, dict[str, bytes]]:
    """Return all files: content by name, by target. folder: for files that are read again at once."""
    limb = {name: BODY[name] for name in ("Hips", "LeftUpLeg", "LeftLeg", "LeftFoot")}
    files: dict[str, dict[str, bytes]] = {
        "stream": {**small_streams(), **doubtful_marks(), **long_streams()},
        "mp4": mp4(),
        "fap": lines(FAPS),
        "bap": lines(BAPS),
        "epf": lines(EPFS),
        "bvh": {"body": bvh(BODY, 3), "limb": bvh(limb, 2), "turned": bvh(limb, 1, "Yrotation")},
        "gltf": {
            "skeleton_text": as_text(skeleton()), "skeleton_binary": skeleton().glb(),
            "mesh_text": as_text(textured()),
            "mesh_binary": textured().glb(),
            "looking": looking(folder),
        },
        "capture": {**faces(), **markers()},
        "live": live(),
        "rtp": packets(),
        "smpl": smpl(),
        "arf": avatar_units(folder),
        "outlines": {"square": outlines(folder)},
        "persona": {"actor": persona(folder)},
        "obj": {"triangles": OBJ.encode()},
        "mtl": {"two": MTL.encode()},
        "mapping": {"all": MAPPING.encode()},
        "ply": meshes(),
        "vrml": {"two": VRML.encode()},
        "wfm": {"four": WFM.encode()},
        "points": {"csv": CSV.encode(), "json": JSON.encode(), "fdp": FDP.encode(), "xface": XFACE.encode()},
    }  # fmt: skip
    files |= saved(folder)
    files["import"] = {"obj": small_head_obj(), **small_heads()}
    files["import"] |= {
        "gltf": small_head_gltf(),
        "xface": small_head_xface(),
        "fdp": small_head_fdp(),
        "wfm": small_head_wfm(),
    }
    return files


def main() -> None:
    """Write the files, instead of those that are there."""
    import shutil
    import tempfile

    target = Path(sys.argv[1]) if len(sys.argv) > 1 else CORPUS
    with tempfile.TemporaryDirectory() as folder:
        files = corpus(Path(folder))
    for name, contents in files.items():
        shutil.rmtree(target / name, ignore_errors=True)
        (target / name).mkdir(parents=True)
        for file, data in contents.items():
            (target / name / f"{file}.bin").write_bytes(data)
    total = sum(len(data) for contents in files.values() for data in contents.values())
    print(f"{target}: {sum(map(len, files.values()))} files, {total / 1000:.0f} kB")


if __name__ == "__main__":
    main()
