"""The targets of fuzzing: readers of bytes, and the words of their files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path

from fba.errors import OptionError, did_you_mean
from tools.fuzz._outcome import Outcome


@dataclass(frozen=True)
class Target:
    """A target.

    name: as on the command line. description: the reader of the bytes.
    check: "module:function"; the function takes the bytes and a folder for files, raises for a finding, and
    returns an `Outcome` otherwise. words: what a mutation inserts. share: of the time, relative to others.
    environment: variables that the process needs. corpus: its folder in the corpus, if that is not `name`.
    besides: another folder whose files are mutated, too.
    random: inputs are some random bytes, which the check makes something of; there are no files to mutate.
    """

    name: str
    description: str
    check: str
    words: tuple[bytes, ...] = ()
    share: int = 1
    environment: Mapping[str, str] = field(default_factory=dict)
    corpus: str = ""
    besides: str = ""
    random: bool = False

    @property
    def folder(self) -> str:
        """Name of the folder in the corpus."""
        return self.corpus or self.name

    def load(self) -> Callable[[bytes, Path], Outcome]:
        """Return the function that checks one input."""
        module, _, name = self.check.partition(":")
        function: Callable[[bytes, Path], Outcome] = getattr(import_module(module), name)
        return function


def targets() -> tuple[Target, ...]:
    """Return all targets."""
    return (
        Target("stream", "the decoder: whole, in chunks, salvaging", _STREAM, _START_CODES, share=8),
        Target(
            "stream-bounds", "the same, with the bounds of every array access checked", _STREAM, _START_CODES,
            share=3, environment={"NUMBA_BOUNDSCHECK": "1"}, corpus="stream",
        ),
        _reader(
            "mp4", "MP4 files with a stream, read, written, read again", b"moov", b"moof", b"trak", b"traf",
            b"trun", b"stz2", b"co64", b"stss", b"edts", b"elst", b"esds", b"uuid", b"udta", b"mdat", b"mp4v",
            b"\0\0\0\0", b"\0\0\0\1", b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\0\0\0\x08free",
            b"\0\0\0\0free", b"\0\0\0\1mdat" + b"\xff" * 8, *_START_CODES,
        ),
        _reader("fap", "ASCII FAPs, read, salvaged, written", b"2.1 a 25 1\n", b"2.2", *_TEXT, b"1 " * 68),
        _reader("bap", "ASCII BAPs, read, salvaged, written", b"3.1 a 25 2\n", b"3.2", *_TEXT, b"1 " * 186),
        _reader("epf", "encoder parameters", b"FBM 3\n", b"ISI 0\n", b"SKN 9\n", b"FIX", b"GDR 1\n", *_TEXT),
        _reader(
            "bvh", "BVH motion, retargeted", b"JOINT a\n{\nOFFSET 0 0 0\nCHANNELS 0\n", b"End Site\n{",
            b"}\n",
            b"CHANNELS 6", b"Zrotation", b"Xposition", b"Frames: ", b"Frame Time:", b"MOTION\n", *_TEXT,
        ),
        _reader(
            "gltf", "glTF motion, retargeted", b'"children":[0]', b'"byteStride":4', b'"sparse":{}',
            b'"count":',
            b'"componentType":5121', b'"type":"MAT4"', b'"interpolation":"CUBICSPLINE"', b"[],", b"{},",
            b"null",
            b"true", b'"matrix":[', b'"uri":"a.bin"', *_TEXT,
        ),
        _reader(
            "capture", "captured faces, as FAPs", b",", b";", b"00:00:00:01.000", b"23:59:59:59.999",
            b"JawOpen", b"timestamp", b"PathFileType", b"Frame#\t", b"Format Version,", b"Trajectories\n",
            b"NO_OF_FRAMES\t", b"MARKER_NAMES\t", b"marker,x,y,z", b"\x02\x50", *_TEXT,
        ),
        _reader("smpl", "motion of SMPL bodies, retargeted", b"PK\x03\x04", b"'shape': (3, 156)", *_TEXT),
        _reader(
            "arf", "avatar animation units, alone and in containers", b"PK\x03\x04", b"\x02\0\0\0\x0f",
            b"\x04\0\0\0\x4b", b"mpeg4-body", b'"parent": 1', b'"shapes": [1]', *_TEXT,
        ),
        _reader(
            "outlines", "indexes of outlines", b"PK\x03\x04", b'"rate": "1/0"', b'"views": [[0, 0]]',
            b"'shape': (4, 9)", b"'descr': '<f8'", *_TEXT,
        ),
        _reader("persona", "Personas", b"PK\x03\x04", b'"kind"', b"NEUTRAL", b"'shape': (4, 9)", *_TEXT),
        _reader(
            "live", "live captures, a datagram in each part", b"\0\0\0\0", b"\xff\xff", b"\x06", b"#bundle\0",
            b"/VMC/Ext/T\0\0,f\0\0", b",sfffffff\0\0\0", b"NaN", b"1e999", b'"FaceFound":true', b"jawOpen&1|",
            b"=head#0,0,0,0,0,0|", b"___iFacialMocap", b"[" * 300, *_TEXT,
        ),
        Target(
            "rtp", "streams in packets, each in a part; connections; descriptions of sessions",
            "tools.fuzz._packets:check_rtp",
            (b"\x80\xe0", b"\xb0\x60", b"\0\x11", b"\xff\xff", b"\0\0", b"\r\na=fmtp:96 ", b"config=", b";",
             b"IN IP6 ::1", *_START_CODES),
        ),
        _reader("face", "face models (.glb)", b"null", b"[]", b"{}", b"-1", b"1e400", *_TEXT),
        _reader("body", "body models (.glb)", b"null", b"[]", b"{}", b"-1", b"1e400", *_TEXT),
        _reader("obj", "OBJ meshes", b"v 1 2 3\n", b"f 1 2 3\n", b"f -1/1/1 -2// 3\n", b"g a\n", b"\\\n",
        *_TEXT),
        _reader("mtl", "materials of OBJ meshes", b"newmtl a\n", b"Kd 1 0 0\n", b"map_Kd a.png\n", *_TEXT),
        _reader(
            "ply", "PLY meshes", b"element vertex 3\n", b"property list uchar int vertex_indices\n",
            b"end_header\n",
            b"format binary_big_endian 1.0\n", b"property float x\n", *_TEXT,
        ),
        _reader(
            "vrml", "VRML meshes", b"Shape { ", b"geometry IndexedFaceSet { ", b"coordIndex [ ", b"point [ ",
            b"DEF a ", b"USE a ", b'\\"', b"}", b"]", *_TEXT,
        ),
        _reader("wfm", "wire frames", b"# VERTEX LIST:\n", b"# FACE LIST:\n", b"0 1 2\n", *_TEXT),
        _reader(
            "points", "feature points: CSV, JSON, FDP, Xface", b"9.3,", b"2.1 0 0 0 0.1\n", b"[", b"]",
            b'"points":',
            b"<fdp", b"<indices>", b"index=\"1\"", *_TEXT,
        ),
        _reader(
            "mapping", "mappings of virtual markers, written again", b"[head]\n", b"[settings]\n",
            b"[virtual_markers]\n", b"vertex = 1, ", b"radius = nan, ", b"fixed = true", b"{ ",
            b" }\n", *_TEXT,
        ),
        replace(_reader("import", "faces of any kind, imported", *_TEXT), besides="face"),
        _reader("any", "files of any kind, recognised", *_TEXT),
        _reader("cache", "files of the cache of slow results"),
        *(
            Target(
                f"encode-{part}", f"random performances of {whose}, encoded in every manner and decoded",
                f"tools.fuzz._performances:check_{part}", random=True,
            )
            for part, whose in (("face", "faces"), ("body", "bodies"), ("both", "faces with bodies"))
        ),
    )  # fmt: skip


def find_target(name: str) -> Target:
    """Return a target by its name, or one made of "module:function", to fuzz a function of your own.

    Raises OptionError, which lists the targets, if there is no such name.
    """
    if ":" in name:
        return Target(name, "a function of your own", name, corpus=".")
    for target in targets():
        if target.name == name:
            return target
    names = [target.name for target in targets()]
    raise OptionError(f"there is no target {name!r}{did_you_mean(name, names)}; there are {', '.join(names)}")


_STREAM = "tools.fuzz._stream_contract:check_stream"
_START_CODES = (
    b"\0\0\1\xba", b"\0\0\1\xbb", b"\0\0\1\xb1", b"\0\0\1\x01", b"\0\0\1\x03", b"\0\0\1\xb3", b"\0\0\1",
)  # fmt: skip
_TEXT = (
    b"", b" ", b"\n", b"\r", b"\t", b"#", b"0", b"-1", b"nan", b"inf", b"1e308", b"-1e999", b"1/0", b'"',
    b"\\",
    b"99999999999999999999", b"\0", b"\xff", b"\xef\xbb\xbf", b"\xd9\xa3", b"1" * 5000, b" " * 5000,
    b"\n" * 5000,
)  # fmt: skip


def _reader(name: str, description: str, *words: bytes) -> Target:
    return Target(name, description, f"tools.fuzz._readers:check_{name}", words)
