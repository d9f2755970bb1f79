"""The command line as a function: arguments in, exit code and output out."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from command_line import Ended, Run
from fba import Animation, BodyTrack, FaceTrack
from fba.cli.main import main


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    def call(*arguments: object, code: int | None = 0) -> Ended:
        capsys.readouterr()
        with warnings.catch_warnings(), pytest.raises(SystemExit) as stop:
            main([str(one) for one in arguments])
        output = capsys.readouterr()
        ended = Ended(int(stop.value.code or 0), output.out, output.err)
        assert code in (None, ended.code), ended
        return ended

    return call


@pytest.fixture
def face() -> Animation:
    """50 frames at 25 frames/s: the jaw opens and shuts, the head nods."""
    values = np.zeros((50, 68), dtype=np.int32)
    mask = np.zeros((50, 68), dtype=bool)
    values[:, 2] = [4 * abs(25 - frame) for frame in range(50)]
    values[:, 47] = [170 * (frame % 10) for frame in range(50)]
    mask[:, [2, 47]] = True
    return Animation(25, np.arange(50), FaceTrack(values, mask), name="face")


@pytest.fixture
def body() -> Animation:
    """50 frames at 25 frames/s: the body turns a little."""
    values = np.zeros((50, 296), dtype=np.int32)
    mask = np.zeros((50, 296), dtype=bool)
    values[:, 183] = [64 * frame for frame in range(50)]
    mask[:, 183] = True
    return Animation(25, np.arange(50), None, BodyTrack(values, mask), name="body")


@pytest.fixture
def bvh(tmp_path: Path) -> Path:
    """Three frames of a skeleton of two legs, a spine and a head; hips 1 m high, 10 frames/s."""
    text = """HIERARCHY
ROOT Hips
{ OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
"""
    for side, x in (("Left", 10), ("Right", -10)):
        text += f"""  JOINT {side}UpLeg {{ OFFSET {x} -5 0 CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT {side}Leg {{ OFFSET 0 -45 0 CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT {side}Foot {{ OFFSET 0 -42 0 CHANNELS 3 Zrotation Xrotation Yrotation
        End Site {{ OFFSET 0 -8 12 }} }} }} }}
"""
    text += """  JOINT Spine { OFFSET 0 12 0 CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Neck { OFFSET 0 45 0 CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT Head { OFFSET 0 10 0 CHANNELS 3 Zrotation Xrotation Yrotation
        End Site { OFFSET 0 18 0 } } } }
}
MOTION
Frames: 3
Frame Time: 0.1
"""
    for degrees in (0, 5, 10):
        knees = ["0 0 0", f"0 {degrees} 0", "0 0 0"]
        text += " ".join(["0 95 0", "0 0 0", *knees, *knees, *["0 0 0"] * 3]) + "\n"
    path = tmp_path / "walk.bvh"
    path.write_text(text)
    return path
