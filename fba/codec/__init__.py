"""The FBA codec: numbers to bits and back (ISO/IEC 14496-2, FBA object; predictive mode)."""

from fba.codec.decoder import Block, Damage, Decoder, animation_of, decode
from fba.codec.encoder import Encoder, EncoderStatistics, encode, encode_with_statistics
from fba.codec.planner import EncoderOptions
from fba.codec.script import encode_planes
from fba.codec.settings import FrameRate, PartSettings, PlaneInfo, PlaneSettings, RangeLists, TimeCode
from fba.codec.stream_info import PartInfo, StreamInfo, probe_stream

__all__ = [
    "Block",
    "Damage",
    "Decoder",
    "Encoder",
    "EncoderOptions",
    "EncoderStatistics",
    "FrameRate",
    "PartInfo",
    "PartSettings",
    "PlaneInfo",
    "PlaneSettings",
    "RangeLists",
    "StreamInfo",
    "TimeCode",
    "animation_of",
    "decode",
    "encode",
    "encode_planes",
    "encode_with_statistics",
    "probe_stream",
]
