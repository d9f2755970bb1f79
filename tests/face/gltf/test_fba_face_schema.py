"""The JSON schema of the extension FBA_face, against what is written and what is read.

And what the official glTF validator says of files.
"""

import copy
import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from test_storage_hostile import CASES

from fba.face.gltf._storage import build
from fba.face.model import PART_KINDS, FaceModel, Material
from fba.parameters import faps, feature_points
from gltf_validator import assert_valid
from json_places import put
from stored_models import face, face_with_level, models

KNOWN = {"UNSUPPORTED_EXTENSION", "UNUSED_OBJECT"}
"""What the validator informs about: it does not know the extension, nor what only that uses."""
jsonschema = pytest.importorskip("jsonschema")
SCHEMA: dict[str, Any] = json.loads((files("fba.face") / "fba_face.schema.json").read_text(encoding="utf-8"))
IN_SCHEMA = [(place, value) for place, value, _ in CASES if place.startswith("extensions/FBA_face/")]
BEYOND = {  # what no schema can say: it depends on other values, or on the document's bytes
    "parts/0/node", "featurePoints", "featurePoints/3.1/vertex", "featurePoints/3.1/part",
    "featurePoints/3.5/position/0", "tables/1/fap", "tables/0/meshes", "tables/2/transforms/0/part",
    "tables/1/meshes/0/part", "tables/1/meshes/0/borders", "tables/1/meshes/0/vertices",
    "tables/1/meshes/0/count",
    "fit/links", "visemes/0/faps",
}  # fmt: skip


def validator() -> Any:
    kind = jsonschema.validators.validator_for(SCHEMA)
    kind.check_schema(SCHEMA)
    return kind(SCHEMA)


def written(model: FaceModel) -> Any:
    builder = build(model)
    return json.loads(json.dumps(builder.root["extensions"]["FBA_face"]))


def test_names_are_those_of_the_tables() -> None:
    definitions = SCHEMA["$defs"]
    assert definitions["fapName"]["enum"] == [fap.name for fap in faps()[2:]]
    assert definitions["featurePointName"]["enum"] == [point.name for point in feature_points()]
    assert definitions["part"]["properties"]["kind"]["enum"] == list(PART_KINDS)


def test_a_face_follows_the_schema() -> None:
    content = written(face_with_level())
    validator().validate(content)
    assert set(content) == set(SCHEMA["properties"])


@settings(max_examples=25)
@given(models())
def test_every_face_follows_the_schema(model: FaceModel) -> None:
    validator().validate(written(model))


@pytest.mark.parametrize(("place", "value"), IN_SCHEMA, ids=[place for place, _ in IN_SCHEMA])
def test_what_the_reader_refuses_the_schema_refuses_too(place: str, value: Any) -> None:
    content = copy.deepcopy(written(face()))
    short = place.removeprefix("extensions/FBA_face/")
    put(content, short, value)
    if not validator().is_valid(content):
        return
    assert short in BEYOND


def test_the_schema_is_part_of_the_documentation() -> None:
    page = Path(__file__).parents[3] / "docs" / "face-models.md"
    assert "fba_face.schema.json" in page.read_text(encoding="utf-8")


def plain(model: FaceModel) -> FaceModel:
    """Without textures, colours and tables."""
    parts = tuple(replace(part, colours=None, texcoords=None, material=Material()) for part in model.parts)
    return replace(model, parts=parts, tables=(), bound=np.full(84, -1))


@pytest.mark.parametrize("which", ["small", "plain", "built-in"])
def test_the_validator_finds_no_fault(tmp_path: Path, which: str) -> None:
    model = {"small": face, "plain": lambda: plain(face()), "built-in": FaceModel.default}[which]()
    model.save(tmp_path / "a.glb")
    assert_valid(tmp_path / "a.glb", informs=KNOWN)
