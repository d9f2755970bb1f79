"""Plans for receivers with a head whose interpolation table (FIT) gives FAPs."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

import fba
from fba import Animation, EncoderOptions, FaceTrack
from fba.codec import quantise
from fba.face import FaceSettings, resolve
from fba.face._expressions import Definitions
from fba.face.interpolation._node import Function, Link, Term
from fba.face.interpolation.table import InterpolationTable
from fba.parameters import fap_numbers, faps
from fba.planning import encode_planned, plan_compact
from made_motion import LENGTH, made_animation


@dataclass(frozen=True)
class Head:
    """A face with a table."""

    fit: InterpolationTable | None
    definitions: Definitions = field(default_factory=Definitions.default)


def share(name: str, coefficient: float) -> Function:
    return Function([Term(coefficient, {name: 1})])


def made_table(rng: np.random.Generator) -> InterpolationTable:
    """A table whose links lead from FAPs to later ones; some give what is sent, most something else."""
    links = []
    for _ in range(rng.integers(1, 12)):
        first, *rest = sorted(rng.choice(np.arange(3, 69), rng.integers(2, 4), replace=False).tolist())
        name = faps()[first - 1].name
        source = [name, *(["expression"] if rng.random() < 0.1 else [])]
        functions = {
            faps()[one - 1].name: share(name, float(rng.choice([0.0, 0.5, 1, 1, 1 / 3]))) for one in rest
        }
        if rng.random() < 0.3:
            functions = {
                to: Function(one.numerator, [Term(1, {name: 1})]) for to, one in functions.items()
            }  # has no value where the source is 0
        links.append(Link(source, functions))
    return InterpolationTable(links)


@pytest.mark.parametrize("seed", range(30))
def test_the_head_shows_the_same(seed: int) -> None:
    rng = np.random.default_rng(seed)
    head: FaceSettings = Head(made_table(rng))
    animation = made_animation(seed)
    options = EncoderOptions(clamp=True)
    expected = quantise(animation, options).face
    decoded = fba.decode(encode_planned(animation, options, preset="compact", model=head)[0]).face
    planned = plan_compact(animation, options, model=head).animation.face
    assert expected is not None
    assert decoded is not None
    assert planned is not None
    assert np.array_equal(resolve(decoded, head), resolve(expected, head))
    assert np.array_equal(resolve(planned, head), resolve(expected, head))


def moving(**paths: np.ndarray) -> Animation:
    """An animation that sends these FAPs."""
    values = np.zeros((LENGTH, 68), dtype=np.int32)
    for name, path in paths.items():
        values[:, fap_numbers()[name] - 1] = path
    return Animation(25, np.arange(LENGTH), FaceTrack(values, np.tile(values.any(axis=0), (LENGTH, 1))))


def sent_names(animation: Animation, head: FaceSettings | None) -> list[set[str]]:
    """Names of the FAPs sent in each segment."""
    plan = plan_compact(animation, model=head)
    masks = [plan.animation.face.mask[one.start] for one in plan.segments]
    return [{faps()[column].name for column in np.flatnonzero(mask)} for mask in masks]


def test_what_the_table_gives_is_not_sent() -> None:
    path = np.cumsum(np.random.default_rng(1).integers(-1, 2, LENGTH)) * 16
    brows = {"raise_l_i_eyebrow": path, "raise_l_m_eyebrow": path // 2, "raise_l_o_eyebrow": path // 4}
    table = InterpolationTable(
        [
            Link(["raise_l_i_eyebrow"], {"raise_l_m_eyebrow": share("raise_l_i_eyebrow", 0.5)}),
            Link(["raise_l_m_eyebrow"], {"raise_l_o_eyebrow": share("raise_l_m_eyebrow", 0.5)}),
        ]
    )
    animation = moving(**brows)
    assert sent_names(animation, Head(table)) == [{"raise_l_i_eyebrow"}]
    assert sent_names(animation, None) == sent_names(animation, Head(None)) == [set(brows)]
    off = path // 2 + np.where(np.arange(LENGTH) == 60, 2, 0)  # one frame that the table does not give
    sent = sent_names(moving(**brows | {"raise_l_m_eyebrow": off}), Head(table))
    assert any("raise_l_m_eyebrow" in one for one in sent)


def test_a_mate_that_the_table_needs_is_sent_and_one_that_it_gives_is_not_copied() -> None:
    path = np.cumsum(np.random.default_rng(2).integers(-1, 2, LENGTH)) * 8
    both = moving(raise_l_i_eyebrow=path, raise_r_i_eyebrow=path, squeeze_l_eyebrow=path // 2)
    needs = Link(["raise_r_i_eyebrow"], {"squeeze_l_eyebrow": share("raise_r_i_eyebrow", 0.5)})
    assert sent_names(both, Head(InterpolationTable([needs]))) == [{"raise_r_i_eyebrow"}]
    gives = Link(["squeeze_l_eyebrow"], {"raise_r_i_eyebrow": share("squeeze_l_eyebrow", 0.5)})
    assert sent_names(both, Head(InterpolationTable([gives]))) in (
        [{"raise_r_i_eyebrow", "squeeze_l_eyebrow"}],  # the left one copies it
        [{"raise_l_i_eyebrow", "raise_r_i_eyebrow", "squeeze_l_eyebrow"}],
    )


def test_a_fap_at_0_that_overrides_the_table_is_sent() -> None:
    table = InterpolationTable([Link(["open_jaw"], {"push_t_lip": share("open_jaw", 1.0)})])
    animation = moving(open_jaw=np.arange(LENGTH) * 4)
    mask = animation.face.mask.copy()
    mask[:, fap_numbers()["push_t_lip"] - 1] = True
    animation = replace(animation, face=FaceTrack(animation.face.values, mask))
    assert sent_names(animation, Head(table)) == [{"open_jaw", "push_t_lip"}]
