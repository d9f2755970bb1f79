"""The FBA codec: from numbers to bits and back (ISO/IEC 14496-2, FBA object; predictive mode).

May use: parameters and the data model.
"""

from fba.codec._block import Block
from fba.codec._code_length import INTRA_BITS, code_lengths, level_bits, range_limit, step_scale
from fba.codec._decoder import Decoder
from fba.codec._encoder import (
    ClampedParameter,
    Encoder,
    EncoderStatistics,
    encode,
    encode_with_statistics,
    warn_of_clamped,
)
from fba.codec._frame_buffer import DecodedFrames, FrameBuffer
from fba.codec._plane.pricing import NextPlane
from fba.codec._plane.slots import weights_of_slots
from fba.codec._quantisation import coarsest_quantisers, count_rounded, exact_quantisers, levels, quantise
from fba.codec._script import encode_planes
from fba.codec._stream.damage import Damage
from fba.codec._stream.mark import marked_table, write_mark, write_opening
from fba.codec._stream_info import PartInfo, StreamInfo, probe_stream
from fba.codec._verification import Verification, digest, verify_stream
from fba.codec._whole_stream import decode
from fba.codec.settings import FrameRate, PartSettings, PlaneInfo, PlaneSettings, RangeLists, TimeCode
from fba.encoder_options import EncoderOptions

__all__ = [
    "INTRA_BITS",
    "Block",
    "ClampedParameter",
    "Damage",
    "DecodedFrames",
    "Decoder",
    "Encoder",
    "EncoderOptions",
    "EncoderStatistics",
    "FrameBuffer",
    "FrameRate",
    "NextPlane",
    "PartInfo",
    "PartSettings",
    "PlaneInfo",
    "PlaneSettings",
    "RangeLists",
    "StreamInfo",
    "TimeCode",
    "Verification",
    "coarsest_quantisers",
    "code_lengths",
    "count_rounded",
    "decode",
    "digest",
    "encode",
    "encode_planes",
    "encode_with_statistics",
    "exact_quantisers",
    "level_bits",
    "levels",
    "marked_table",
    "probe_stream",
    "quantise",
    "range_limit",
    "step_scale",
    "verify_stream",
    "warn_of_clamped",
    "weights_of_slots",
    "write_mark",
    "write_opening",
]
