"""Face models written and read again."""

from __future__ import annotations

from pathlib import Path

from hypothesis import HealthCheck, given, settings
from stored_models import assert_same, face, models

from fba.face.model import FaceModel
from fba.face.storage import load, save


def test_a_face_comes_back_as_it_was(tmp_path: Path) -> None:
    model = face()
    model.save(tmp_path / "a.glb")
    again = FaceModel.load(tmp_path / "a.glb")
    assert_same(model, again)
    again.save(tmp_path / "b.glb")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()


@settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(models())
def test_any_face_comes_back_as_it_was(tmp_path: Path, model: FaceModel) -> None:
    save(model, tmp_path / "a.glb")
    again = load(tmp_path / "a.glb")
    assert_same(model, again)
    save(again, tmp_path / "b.glb")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
