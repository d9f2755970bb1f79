"""Who deforms: as wished; the processor where there is no graphics card; else who was measured as faster."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner

from fba.cli.main import group
from fba_player.gl.gpu import choice
from fba_player.gl.gpu.choice import Choice, is_software, prefer, wished

CARD = {"GL_VENDOR": "Someone", "GL_RENDERER": "Fast 9000", "GL_VERSION": "4.6 driver 1.2"}


@pytest.fixture(autouse=True)
def _nothing_kept_or_wished(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    monkeypatch.delenv("FBA_DEFORM", raising=False)
    prefer("auto")
    yield
    prefer("auto")


class Trials:
    """Pictures that take these seconds; the first two in each way take ten times as long."""

    def __init__(self, cpu: float, gpu: float) -> None:
        self.seconds = {False: cpu, True: gpu}
        self.made: list[bool] = []

    def __call__(self, on_gpu: bool) -> float:
        self.made.append(on_gpu)
        return self.seconds[on_gpu] * (10 if self.made.count(on_gpu) <= 2 else 1)


def never(on_gpu: bool) -> float:
    raise AssertionError("nothing is to be measured here")


@pytest.mark.parametrize(
    ("cpu", "gpu", "chosen"),
    [(4.0, 1.0, True), (4.0, 3.7, True), (4.0, 4.0, False), (4.0, 3.9, False), (2.0, 10.0, False)],
)
def test_the_faster_one_and_the_processor_where_they_are_alike(cpu: float, gpu: float, chosen: bool) -> None:
    trials = Trials(cpu / 1e3, gpu / 1e3)
    made = Choice(CARD)
    assert made.on_gpu(20000, trials) is chosen
    assert f"{cpu:.2f} ms" in made.reason
    assert f"{gpu:.2f} ms" in made.reason
    assert trials.made.count(True) == trials.made.count(False) >= 5


def test_slow_pictures_now_and_then_do_not_count() -> None:
    seconds = iter([0.1, 0.1, 0.004, 0.09, 0.004, 0.004, 0.08, 0.004, 0.004])

    def trial(on_gpu: bool) -> float:
        return next(seconds) if on_gpu else 0.006

    assert Choice(CARD).on_gpu(1, trial)


def test_it_is_measured_once_and_then_the_same_from_run_to_run() -> None:
    assert Choice(CARD).on_gpu(500, Trials(0.004, 0.001))
    again = Choice(CARD)
    assert again.on_gpu(500, never)
    assert "0.00 ms" not in again.reason
    assert again.on_gpu(500, never)


@pytest.mark.parametrize("changed", [*CARD, "size"])
def test_another_card_driver_or_model_is_measured_anew(changed: str) -> None:
    assert Choice(CARD).on_gpu(500, Trials(0.004, 0.001))
    other = CARD if changed == "size" else {**CARD, changed: "another"}
    trials = Trials(0.001, 0.004)
    assert not Choice(other).on_gpu(501 if changed == "size" else 500, trials)
    assert trials.made


@pytest.mark.parametrize(
    "name",
    [
        "llvmpipe (LLVM 15.0.6, 256 bits)",
        "softpipe",
        "Software Rasterizer",
        "Google SwiftShader",
        "ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device (Subzero)), SwiftShader driver)",
        "D3D12 (Microsoft Basic Render Driver)",
        "Apple Software Renderer",
        "GDI Generic",
    ],
)
def test_what_is_no_graphics_card_is_not_measured(name: str) -> None:
    made = Choice({**CARD, "GL_RENDERER": name})
    assert not made.on_gpu(500, never)
    assert name in made.reason


@pytest.mark.parametrize(
    "name",
    ["NVIDIA GeForce RTX 3060/PCIe/SSE2", "AMD Radeon RX 6800 (radeonsi)", "Mesa Intel(R) UHD", "Apple M2"],
)
def test_graphics_cards_are_known_as_such(name: str) -> None:
    assert not is_software(name)


def test_wishes_come_before_what_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    assert Choice(CARD, "gpu").on_gpu(500, never)
    assert not Choice(CARD, "cpu").on_gpu(500, never)
    monkeypatch.setenv("FBA_DEFORM", "gpu")
    made = Choice({**CARD, "GL_RENDERER": "llvmpipe"})
    assert made.on_gpu(500, never)
    assert made.reason == "as wished"
    prefer("cpu")
    assert not Choice(CARD).on_gpu(500, never)
    assert Choice(CARD, "gpu").on_gpu(500, never)
    prefer("auto")
    assert wished("auto") == "gpu"
    monkeypatch.setenv("FBA_DEFORM", "sideways")
    assert wished("auto") == "auto"


@pytest.mark.parametrize("ask", [prefer, wished, lambda word: Choice(CARD, word)])
def test_other_words_are_refused(ask: Callable[[str], object]) -> None:
    with pytest.raises(ValueError, match="auto, cpu, gpu"):
        ask("fpga")


def test_a_card_that_fails_is_not_chosen_nor_asked_again() -> None:
    trials = Trials(0.004, choice.FAILED)
    made = Choice(CARD)
    assert not made.on_gpu(500, trials)
    assert "wrong" in made.reason
    assert trials.made.count(True) == 1
    assert not Choice(CARD).on_gpu(500, never)
    given_up = Choice(CARD, "gpu")
    given_up.give_up("no room")
    assert not given_up.on_gpu(500, never)
    assert "no room" in given_up.reason


@pytest.mark.parametrize("command", ["play", "render"])
def test_the_commands_say_it_to_the_player(command: str, tmp_path: Path) -> None:
    """What they are given to show is not there: that is said after the options were heard."""
    missing = str(tmp_path / "none.fba")
    for word, means in (("gpu", "gpu"), ("auto", "auto"), ("cpu", "cpu")):
        prefer("auto")
        result = CliRunner().invoke(group, [command, "--deform", word, missing])
        assert result.exit_code == 2
        assert wished("auto") == means
    assert "fpga" in CliRunner().invoke(group, [command, "--deform", "fpga", missing]).output
    assert "--deform" in CliRunner().invoke(group, [command, "--help"]).output
