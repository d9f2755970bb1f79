"""Sentences that programs speak and say when each phone begins: flite, and eSpeak NG by its library.

The thresholds of the recogniser were chosen on `KNOWN`; `OTHERS` were written and measured afterwards.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import re
import shutil
import subprocess
import tempfile
import wave
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fba.arrays import Int16
from fba.audio import read_mono
from fba.speech import RATE, Phone

FLITE = ("slt", "rms", "awb", "kal16", "kal")
"""Voices of flite: a woman, men, one of them a Scot, and an old voice at 16 and at 8 kHz."""
VOICES = (*FLITE, "espeak")
KNOWN = (
    "Bob put five thin maps by the moon.",
    "My mother bought a purple umbrella from the shop.",
    "The food was too good to move away from.",
    "Five brave fishermen found a very large fish.",
    "She sells small shells, but he chose a cheap ship.",
    "Why would you want to go home before noon?",
    "Peter bumped his elbow on the lamp post.",
    "We measured the thickness of both leather gloves.",
    "Yesterday the train arrived three hours late.",
    "Please open the window, the room is warm.",
    "I think that the weather will change on Monday.",
    "Who broke the blue cup, and where is the key?",
)
OTHERS = (
    "A small dog slept under the kitchen table.",
    "The ferry leaves the island at half past seven.",
    "Could you help me carry this box up the stairs?",
    "Nobody believed the boy who saw a bear in the garden.",
    "Her brother plays the violin in a famous orchestra.",
    "Bread and butter are in the basket on the left.",
    "The judge asked the witness to speak a little louder.",
    "Thick fog covered the valley until the late morning.",
    "They painted the old fence with bright green paint.",
    "I never drink coffee after four in the afternoon.",
    "A pipe burst in the basement of the museum.",
    "Most people forget where they put their glasses.",
    "The farmer drove his cows across the wooden bridge.",
    "What is the shortest way from here to the station?",
    "Rain is expected in the north, and wind on the coast.",
    "He wrote a long letter, but she did not answer it.",
    "The baby laughed whenever the cat jumped on the sofa.",
    "Fresh fruit is cheaper at the market behind the church.",
    "Please turn off the lights before you leave the house.",
    "Our team lost the match by only one point.",
    "The museum shows coins, weapons and jewels of kings.",
    "Wash your hands with warm water and plenty of soap.",
    "A thousand birds flew over the harbour at dawn.",
    "You should have told me that the road was closed.",
    "The engine makes a strange noise when it is cold.",
    "Mary wants to become a pilot or a marine biologist.",
    "We waited for an hour, then we took another bus.",
    "The soup needs more pepper and a pinch of salt.",
    "Two women discussed the price of an antique mirror.",
    "My father used to repair watches in that tiny shop.",
    "The path through the forest is steep and full of roots.",
    "Is there a doctor among the passengers?",
    "They found a map of the cave inside a broken bottle.",
    "The bank will be closed on Friday because of a holiday.",
    "She whispered the answer into the ear of her friend.",
    "Half of the students failed the first examination.",
    "The moon was so bright that we could read outside.",
    "Put the vase with the yellow tulips near the window.",
    "An old oak stands in the middle of the village square.",
    "The company moved its office to a larger building.",
    "He threw the ball over the roof by mistake.",
    "Do not touch the stove, it may still be hot.",
    "The river froze twice during that terrible winter.",
    "Every child received a book and a bag of nuts.",
    "The actor forgot his words, and everybody laughed.",
    "I would rather walk than sit in this crowded train.",
    "The blue jacket belongs to the man with the beard.",
    "Few tourists ever visit the southern part of the city.",
    "They are going to measure the depth of the lake.",
    "Choose a number between one and nine.",
    "The teacher explained the rule with a simple example.",
    "A voice on the radio warned of heavy storms.",
    "We bought cheese, ham and a bottle of apple juice.",
    "The wheels of the wagon sank deep into the mud.",
    "Thank you for the beautiful flowers you sent me.",
    "The bishop blessed both of the new fishing boats.",
    "How many keys does a modern piano have?",
    "The thief vanished before the police arrived.",
    "Good poems often sound better when they are read aloud.",
    "The young prince refused to marry for money.",
)


@dataclass(frozen=True)
class Spoken:
    """A sentence: its text, its sound, int16 at 16 kHz, and the phones as the voice says that they are."""

    text: str
    sound: Int16
    phones: list[Phone]


def say(texts: Sequence[str], voices: Sequence[str]) -> Iterator[Spoken]:
    """Yield all texts by all voices; each text once before any is said again."""
    with tempfile.TemporaryDirectory(prefix="fba-") as folder:
        path = Path(folder) / "speech.wav"
        for turn in range(len(voices)):
            for at, text in enumerate(texts):
                phones = speak(voices[(at + turn) % len(voices)], text, path)
                yield Spoken(text, np.concatenate(list(read_mono(path, RATE))), phones)


def speak(voice: str, text: str, path: Path) -> list[Phone]:
    """Let a voice, one of `VOICES`, speak a text into a WAV file; return its phones."""
    return _speak_espeak(text, path) if voice == "espeak" else _speak_flite(voice, text, path)


def _speak_flite(voice: str, text: str, path: Path) -> list[Phone]:
    program = shutil.which("flite")
    assert program is not None
    words = [program, "-voice", voice, "-t", text, "-psdur", "-o", str(path)]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()
    phones, start = [], 0.0
    for each in said:
        name, _, end = each.rpartition(":")
        phones.append(Phone(name if name == "pau" else name.upper(), start, float(end)))
        start = float(end)
    return phones


class _Event(ctypes.Structure):
    """`espeak_EVENT` of speak_lib.h. type: 0 for the end of a list, 7 for a phoneme. position: ms."""

    _fields_ = [
        ("type", ctypes.c_int), ("number", ctypes.c_uint), ("text", ctypes.c_int), ("length", ctypes.c_int),
        ("position", ctypes.c_int), ("sample", ctypes.c_int), ("user", ctypes.c_void_p),
        ("name", ctypes.c_char * 8),
    ]  # fmt: skip


PHONES = {
    "p": "P", "b": "B", "m": "M", "f": "F", "v": "V", "T": "TH", "D": "DH", "t": "T", "t#": "T", "t2": "T",
    "d": "D", "k": "K", "g": "G", "N": "NG", "tS": "CH", "dZ": "JH", "S": "SH", "Z": "ZH", "s": "S",
    "z": "Z", "n": "N", "n-": "N", "l": "L", "@L": "AH L", "r": "R", "r-": "R", "3": "ER", "3:": "ER",
    "h": "HH", "w": "W", "j": "Y", "A:": "AA", "A@": "AA R", "a": "AE", "aa": "AE", "a#": "AH", "V": "AH",
    "0": "AA", "0#": "AA", "@": "AH", "@2": "AH", "E": "EH", "e@": "EH R", "I": "IH", "I#": "IH",
    "I2": "IH", "i": "IY", "i:": "IY", "i@": "IY AH", "i@3": "IH ER", "O:": "AO", "O": "AO", "O2": "AO",
    "o@": "AO R", "O@": "AO R", "U": "UH", "u:": "UW", "U@": "UH R", "aI": "AY", "aI@": "AY AH",
    "aI3": "AY ER", "eI": "EY", "OI": "OY", "aU": "AW", "oU": "OW", "_": "SIL", "_:": "SIL", "?": "SIL",
}  # fmt: skip
"""ARPAbet of eSpeak's mnemonics for American English; two phones share the time evenly."""
SILENT, LONGEST_CLOSURE = 2, 0.06
"""Largest sample of a silence, and seconds of the longest one that belongs to the phone behind it."""
NO_TIME = 0.005
"""Seconds: an l that is shorter shares the time of the vowel before it evenly."""


def _speak_espeak(text: str, path: Path) -> list[Phone]:
    name = ctypes.util.find_library("espeak-ng")
    assert name is not None
    library = ctypes.CDLL(name)
    synchronous, phoneme_events, stay = 2, 1, 0x8000
    rate = library.espeak_Initialize(synchronous, 0, None, phoneme_events | stay)
    library.espeak_SetVoiceByName(b"en-us")
    sounds: list[bytes] = []
    events: list[tuple[float, str]] = []

    def listen(samples: Any, count: int, event: Any) -> int:
        if samples and count:
            sounds.append(ctypes.string_at(samples, 2 * count))
        for at in range(10_000):
            if event[at].type == 0:
                break
            if event[at].type == 7 and event[at].name != b";":  # a glide
                events.append((event[at].position / 1000, event[at].name.decode()))
        return 0

    kind = ctypes.CFUNCTYPE(
        ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(_Event)
    )
    callback = kind(listen)
    library.espeak_SetSynthCallback(callback)
    said = text.encode()
    library.espeak_Synth(said, len(said) + 1, 0, 0, 0, 1, None, None)
    sound = np.frombuffer(b"".join(sounds), dtype="<i2")
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, rate, 0, "NONE", ""))
        file.writeframes(sound.tobytes())
    return _phones(_before_silence(events, sound, rate), len(sound) / rate)


def _before_silence(events: list[tuple[float, str]], sound: Int16, rate: int) -> list[tuple[float, str]]:
    """Return events at the begin of the silence before them; longer silences are pauses of their own.

    eSpeak reports a phone behind the silence that it puts before it: 38 or 48 ms of zeros before p, t, k and
    tS, 32 before b, d and g, in which the mouth is closed already, and 100 ms and more at commas.
    """
    result: list[tuple[float, str]] = []
    before = 0
    for start, name in events:
        at = round(start * rate)
        loud = np.flatnonzero(np.abs(sound[before:at].astype(np.int64)) > SILENT)
        silence = (at - before - (loud[-1] + 1 if len(loud) else 0)) / rate
        if silence > LONGEST_CLOSURE:
            result.append((start - silence, "_"))
            silence = 0.0
        result.append((start - silence, name))
        before = at
    return result


def _phones(events: list[tuple[float, str]], end: float) -> list[Phone]:
    phones = [Phone("pau", 0.0, events[0][0])]
    times = [start for start, _ in events] + [end]
    for at in range(1, len(events)):  # an l behind a vowel has no time of its own
        if times[at + 1] - times[at] < NO_TIME and events[at][1] == "l":
            times[at] = (times[at - 1] + times[at + 1]) / 2
    for start, stop, (_, name) in zip(times, times[1:], events, strict=False):
        names = PHONES[re.sub("[',%=|]", "", name)].split()
        step = (stop - start) / len(names)
        phones += [
            Phone("pau" if each == "SIL" else each, start + step * at, start + step * (at + 1))
            for at, each in enumerate(names)
        ]
    return phones
