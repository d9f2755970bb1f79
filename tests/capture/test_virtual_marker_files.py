"""TOML files of virtual markers: what is written is read, and what is wrong in one is named."""

from pathlib import Path

import pytest

from fba.capture.virtual_markers import MarkerMapping, VirtualMarker
from fba.capture.virtual_markers._mapping_files import read_mapping, write_mapping
from fba.capture.virtual_markers.mapping import MadeFor
from fba.errors import FormatError

MAPPING = MarkerMapping(
    {
        "Chin": VirtualMarker(12, 0.02, 0.03),
        'Anna:"L\u00e4chen"\n\x7f': VirtualMarker(7, 1e-9, 2.5),
        "FHL": VirtualMarker(1, 0.1, 0.1, fixed=True),
        "FHR": VirtualMarker(0, 0.1, 0.1, fixed=True),
        "Cap": VirtualMarker(None, fixed=True),
        "Lip": VirtualMarker(9, 0.5, 0.25, follows="Chin", share=0.75),
    },
    assignment="exclusive", overlap="add", scale=("FHL", "FHR"),
    made_for=MadeFor("head.obj", 20, 30, "00ff", "ff00"),
)  # fmt: skip
LEAST = '[virtual_markers]\n"Chin" = { vertex = 12, radius = 0.02 }\n'


def test_what_is_written_is_read(tmp_path: Path) -> None:
    write_mapping(tmp_path / "m.toml", MAPPING)
    assert read_mapping(tmp_path / "m.toml") == MAPPING
    (tmp_path / "least.toml").write_text(LEAST)
    assert read_mapping(tmp_path / "least.toml") == MarkerMapping({"Chin": VirtualMarker(12, 0.02, 0.02)})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("[virtual_markers\n", "is not TOML: .*expected lines such as \"Chin\""),
        ("[markers]\nChin = '2.1'\n", r"has no table \[virtual_markers\]"),
        ("virtual_markers = 3\n", r"has no table \[virtual_markers\]"),
        ("[virtual_markers]\n", r"has no table \[virtual_markers\]"),
        ("[virtual_markers]\nChin = '2.1'\n", r"'Chin' is '2.1'; expected a table such as \{ vertex"),
        ("[virtual_markers]\nChin = { vertex = 1.5, radius = 1 }\n", "must be a whole number, not 1.5"),
        ("[virtual_markers]\nChin = { vertex = true, radius = 1 }\n", "must be a whole number, not True"),
        ("[virtual_markers]\nChin = { vertex = -1, radius = 1 }\n", "'Chin': vertices are counted from 0"),
        ("[virtual_markers]\nChin = { vertex = 1, radius = nan }\n", "the radius must be a positive number"),
        ("[virtual_markers]\nChin = { vertex = 1, radius = 1, depth = inf }\n", "the depth must be"),
        (f"[virtual_markers]\nChin = {{ vertex = 1, radius = 1{400 * '0'} }}\n", "'Chin': int too large"),
        (f"[virtual_markers]\nChin = {{ vertex = {5000 * '1'} }}\n", "is not TOML: Exceeds the limit"),
        ("[virtual_markers]\nChin = { vertex = 1 }\n", "'Chin' has no radius"),
        ("[virtual_markers]\nChin = { radius = 1 }\n", "'Chin' has no vertex; only fixed markers"),
        ("[virtual_markers]\nChin = { vertex = 1, raduis = 1 }\n", "'Chin': there is no 'raduis'; known are"),
        ("[virtual_markers]\nChin = { vertex = 1, radius = 1, follows = 2 }\n", "must be a text, not 2"),
        ("[virtual_markers]\nChin = { vertex = 1, radius = 1, fixed = 'no' }\n", "must be true or false"),
        (LEAST + '"Lip" = { vertex = 12, radius = 1 }\n', "'Chin' and 'Lip' are both at vertex 12"),
        ("[settings]\nscale = 'FHL'\n" + LEAST, "scale must be a list of two markers"),
        ("[settings]\nscale = ['Chin', 'Lip']\n" + LEAST, "scale: 'Chin' is no fixed marker"),
        (f"[settings]\nsquint = 1{400 * '0'}\n" + LEAST, "too large"),
        ("[settings]\noverlap = 3\n" + LEAST, "overlap must be a word, not 3"),
        ("[settings]\nassignment = 'both'\n" + LEAST, "assignment must be one of shared, exclusive"),
        ("[settings]\nasignment = 'shared'\n" + LEAST, "settings: there is no 'asignment'"),
        ("settings = 1\n" + LEAST, "settings must be a table, not 1"),
        ("[head]\nname = 'a'\n" + LEAST, "head: connectivity must be a text, not None"),
        ("[heads]\nname = 'a'\n" + LEAST, "there is no table 'heads'"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text(text)
    with pytest.raises(FormatError, match=words) as caught:
        read_mapping(path)
    assert str(caught.value).startswith(str(path))
