"""`fba demo`: what it leaves behind. Drawing is left out here: .ci/run makes the whole film."""

from pathlib import Path

import pytest
from click.testing import CliRunner

import fba
from fba.cli.commands import demo
from fba.cli.main import group

SAMPLES = Path(fba.__file__).parent / "samples"


def test_the_folder_has_the_samples_and_the_stream_made_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(demo, "_render", lambda *_: None)
    folder = tmp_path / "demo"
    result = CliRunner().invoke(group, ["demo", "--no-play", "--out", str(folder)])
    assert result.exit_code == 0, result.output
    names = sorted(path.name for path in SAMPLES.iterdir() if path.suffix != ".txt")
    assert names == ["hello.bvh", "hello.fap", "hello.wav", "talk.c3d"]
    for name in names:
        assert (folder / name).read_bytes() == (SAMPLES / name).read_bytes()
        assert str(folder / name) in result.output
    stream = fba.read(folder / "hello.fba", bap_steps="visage")
    assert len(stream) == len(fba.read(folder / "hello.fap"))
    assert stream.face is not None
    assert stream.body is not None
    talk = fba.read(folder / "talk.fba")
    assert float(talk.duration) == pytest.approx(6.0)
    assert talk.face is not None
    assert talk.body is not None
    assert "talk.c3d, 6.00 s" in result.output
