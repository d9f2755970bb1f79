"""Speech as the motion of a face: from a recording, a text or the timings of other programs.

`split_text` and `find_speech` find the phones of a text in a sound, `read_timings` reads those of other
programs, and `perform` lets a face speak them.
"""

from fba.speech._alignment import find_speech
from fba.speech._live import LiveSpeech
from fba.speech._performance import Coding, encoder_options, enliven, perform
from fba.speech._pieces import RATE
from fba.speech._prosody import Prosody
from fba.speech._sounds import Phone, Shape, Speech, Word, find_shapes
from fba.speech._text import split_text
from fba.speech._timings import VisemeFormat, find_timings, format_visemes, read_timings
from fba.speech._visemes import read_shapes
from fba.speech._voices import speak_text

__all__ = [
    "RATE", "Coding", "LiveSpeech", "Phone", "Prosody", "Shape", "Speech", "VisemeFormat", "Word",
    "encoder_options", "enliven", "find_shapes", "find_speech", "find_timings", "format_visemes", "perform",
    "read_shapes", "read_timings", "speak_text", "split_text",
]  # fmt: skip
