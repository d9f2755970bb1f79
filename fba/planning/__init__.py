"""Planning: what a stream need not send, and where I planes pay.

May use: the codec, and the rules by which a face fills in what was not sent.
"""

from fba.planning.plan import PRESETS, Plan, encode_planned, plan_compact, plan_exact

__all__ = ["PRESETS", "Plan", "encode_planned", "plan_compact", "plan_exact"]
