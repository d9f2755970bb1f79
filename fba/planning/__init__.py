"""Planning: what a stream need not send, where I planes pay, and how much may be lost within a tolerance.

May use: the codec; faces and bodies, for what they show and by how much it moves.
"""

from fba.planning._body_tolerance import body_errors
from fba.planning._encoding import BitRate, Encoded, Goal, encode, encode_stream
from fba.planning._live_encoder import LiveEncoder
from fba.planning._near_lossless import encode_within_tolerance
from fba.planning._plan import Plan, encode_planned, plan_compact, plan_exact
from fba.planning._stillness import hold_still
from fba.planning._tolerance import BodyErrors, FaceErrors, NearLossless, Tolerance

__all__ = [
    "BitRate", "BodyErrors", "Encoded", "FaceErrors", "Goal", "LiveEncoder", "NearLossless", "Plan",
    "Tolerance", "body_errors", "encode", "encode_planned", "encode_stream", "encode_within_tolerance",
    "hold_still", "plan_compact", "plan_exact",
]  # fmt: skip
