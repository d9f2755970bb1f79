"""The FBA codec: from numbers to bits and back (ISO/IEC 14496-2, FBA object; predictive mode).

May use: parameters and the data model.
"""

from fba.codec._coded_frames import Block
from fba.codec._decoder import Decoder, decode
from fba.codec._encoder import ClampedParameter, Encoder, EncoderStatistics, encode_animation
from fba.codec._frame_buffers import DecodedFrames, FrameBuffer
from fba.codec._plane.pricing import NextPlane
from fba.codec._quantisation import (
    coarsest_quantisers,
    count_rounded,
    exact_quantisers,
    levels,
    quantise,
    range_limit,
    step_scale,
)
from fba.codec._recoding import (
    PlaneStart,
    StreamPlanes,
    read_plane_start,
    read_planes,
    recode,
    replace_time_code,
)
from fba.codec._script import encode_planes
from fba.codec._stream.clock import time_code
from fba.codec._stream.damage import Damage
from fba.codec._stream.mark import marked_table, write_mark, write_opening
from fba.codec._stream_info import PartInfo, StreamInfo, probe_stream
from fba.codec._verification import Verification, digest, verify_stream
from fba.codec.settings import FrameRate, PartSettings, PlaneInfo, PlaneSettings, RangeLists, TimeCode
from fba.encoder_options import EncoderOptions

__all__ = [
    "Block", "ClampedParameter", "Damage", "DecodedFrames", "Decoder", "Encoder", "EncoderOptions",
    "EncoderStatistics", "FrameBuffer", "FrameRate", "NextPlane", "PartInfo", "PartSettings", "PlaneInfo",
    "PlaneSettings", "PlaneStart", "RangeLists", "StreamInfo", "StreamPlanes", "TimeCode", "Verification",
    "coarsest_quantisers", "count_rounded", "decode", "digest", "encode_animation", "encode_planes",
    "exact_quantisers", "levels", "marked_table", "probe_stream", "quantise", "range_limit",
    "read_plane_start", "read_planes", "recode", "replace_time_code", "step_scale", "time_code",
    "verify_stream", "write_mark", "write_opening",
]  # fmt: skip
