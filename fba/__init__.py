"""fba: the MPEG-4 Face and Body Animation codec, converters and player.

Everything public is imported on first use, so that `import fba` costs next to nothing::

    import fba

    animation = fba.read("walk.bvh")
    data = fba.encode(animation)
    assert fba.decode(data).rate == animation.rate
"""

from __future__ import annotations

TYPE_CHECKING = False  # as typing has it, whose import takes longer than all of this
if TYPE_CHECKING:
    from typing import Any

    from fba import archive as archive
    from fba import audio as audio
    from fba import body, capture, emotion, face
    from fba import carriage as carriage
    from fba import codec as codec
    from fba import figures as figures
    from fba import formats as formats
    from fba import live as live
    from fba import parameters as parameters
    from fba import persona as persona
    from fba import planning as planning
    from fba import player as player
    from fba import serving as serving
    from fba import speech as speech
    from fba.animation import Animation, BodyTrack, FaceTrack, Frame
    from fba.codec import Decoder, Encoder, StreamInfo, decode
    from fba.encoder_options import EncoderOptions
    from fba.errors import (
        BitstreamError,
        DisplayError,
        FbaError,
        FbaWarning,
        FormatError,
        LimitError,
        ModelError,
        OptionError,
        RangeError,
        UnsupportedError,
    )
    from fba.formats import probe, read, write
    from fba.limits import Limits
    from fba.planning import encode

__version__ = "0.1.0"

_NAMES = {
    "fba.animation": ("Animation", "BodyTrack", "FaceTrack", "Frame"),
    "fba.codec": ("Decoder", "Encoder", "StreamInfo", "decode"),
    "fba.encoder_options": ("EncoderOptions",),
    "fba.errors": (
        "BitstreamError", "DisplayError", "FbaError", "FbaWarning", "FormatError", "LimitError", "ModelError",
        "OptionError", "RangeError", "UnsupportedError",
    ),
    "fba.formats": ("probe", "read", "write"),
    "fba.limits": ("Limits",),
    "fba.planning": ("encode",),
}  # fmt: skip
"""Public names by the module that they are imported from."""
_MODULES = (
    "archive", "audio", "body", "capture", "carriage", "codec", "emotion", "face", "figures", "formats",
    "live", "outlines", "parameters", "persona", "planning", "player", "serving", "speech",
)  # fmt: skip

__all__ = [
    "Animation", "BitstreamError", "BodyTrack", "Decoder", "DisplayError", "Encoder", "EncoderOptions",
    "FaceTrack", "FbaError", "FbaWarning", "FormatError", "Frame", "LimitError", "Limits", "ModelError",
    "OptionError", "RangeError", "StreamInfo", "UnsupportedError", "body", "capture", "decode", "emotion",
    "encode", "face", "probe", "read", "write",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    from importlib import import_module

    module = next((module for module, names in _NAMES.items() if name in names), None)
    if module is not None:
        value = getattr(import_module(module), name)
    elif name in _MODULES:
        value = import_module(f"fba.{name}")
    else:
        raise AttributeError(f"module 'fba' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_MODULES})
