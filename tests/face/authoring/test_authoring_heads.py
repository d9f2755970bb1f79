"""Tables of real heads: the built-in one, and MakeHuman's where its files are."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from fba.face import FaceModel
from fba.face.authoring import author
from fba.face.checks import check_faps
from fba.face.checks._lid_rules import SPLITS, lid_cut, lid_gap
from fba.face.checks.posing import Poser


def test_the_built_in_head_plays_every_fap_right() -> None:
    head = FaceModel.default()
    assert [str(finding) for finding in check_faps(head)] == []


@pytest.mark.slow
def test_the_built_in_head_authored_anew() -> None:
    head = FaceModel.default()
    started = time.process_time()
    again = author(head.parts, head.points, bound=head.bound)
    assert time.process_time() - started < 60  # some seconds on a machine of its own
    assert not again.lost
    assert [str(finding) for finding in check_faps(again)] == []
    poser = Poser(again)
    for side in ("left", "right"):
        for split in SPLITS:
            assert lid_gap(poser, side, split) < 0.02
            assert lid_cut(poser, side, split) < 0.01


@pytest.mark.slow
def test_makehuman_plays_every_fap_right(shared: Path) -> None:
    from fba.face.importers import import_model

    head = import_model(shared / "models" / "makehuman")
    again = author(head.parts, head.points, bound=head.bound)
    assert not again.lost
    assert [str(finding) for finding in check_faps(again)] == []
