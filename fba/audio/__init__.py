"""Sound as arrays: any part of a file that FFmpeg reads, and the mono sound that speech is found in.

Nothing here knows faces, streams or devices. PyAV is imported where a file is opened.
"""

from fba.audio._mono import find_duration, read_mono
from fba.audio._pipe import RATES, Pipe, read_pipe
from fba.audio._sound_file import CHANNELS, SoundFile, av_version, import_av, open_sound

__all__ = [
    "CHANNELS", "RATES", "Pipe", "SoundFile", "av_version", "find_duration", "import_av", "open_sound",
    "read_mono", "read_pipe",
]  # fmt: skip
