"""Pictures look as they did when somebody last looked at them: tests/player/gl/references.

Where a change of looks is wanted, draw them anew (tests/helpers/make_references.py) and look at each.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from picture_difference import difference
from reference_cases import FOLDER, Drawer, cases

MOST_BYTES = 1_000_000


@pytest.fixture(scope="module")
def draw(opengl: None) -> Iterator[Drawer]:
    with Drawer() as drawer:
        yield drawer


@pytest.mark.parametrize("name", list(cases()))
def test_the_picture_equals_its_reference(draw: Drawer, name: str, tmp_path: Path) -> None:
    case = cases()[name]
    drawn = draw(case)
    with Image.open(case.path) as picture:
        reference = np.asarray(picture)
    found = difference(reference, drawn)
    if not found.alike:
        Image.fromarray(drawn).save(tmp_path / f"{name}.png")
    assert found.alike, (
        f"{found}\ndrawn: {tmp_path / name}.png, reference: {case.path}\nif it is as it should be: "
        f"python tests/helpers/make_references.py --only {name}"
    )


def test_the_references_are_those_of_the_table_and_small() -> None:
    files = set(FOLDER.glob("*.png"))
    assert files == {case.path for case in cases().values()}
    assert sum(path.stat().st_size for path in files) < MOST_BYTES


def test_every_switch_and_look_has_a_reference() -> None:
    from fba_player.scene.scene import LOOKS, SWITCHES

    shown = {text.partition("=")[0] for case in cases().values() for text in case.switches}
    assert shown == set(SWITCHES)
    assert {case.view or "figure" for case in cases().values()} == set(LOOKS)
