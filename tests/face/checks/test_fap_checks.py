"""check_faps finds each way in which a model can break the standard: models are broken on purpose."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fba.errors import OptionError
from fba.face import FaceModel
from fba.face._tables import FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.face.authoring import author
from fba.face.checks import Finding, check_faps
from fba.face.checks._fap_checks import check_posed
from fba.face.checks._posing import Poser
from fba.parameters import point_rows
from grid_head import grid_head


@pytest.fixture(scope="module")
def head() -> FaceModel:
    parts, points, bound = grid_head()
    return author(parts, points, bound=bound)


def with_table(
    head: FaceModel, fap: int, change: Callable[[FaceDefTables], FaceDefTables | None]
) -> FaceModel:
    tables = [change(table) if table.fap == fap else table for table in head.tables]
    return replace(head, tables=tuple(table for table in tables if table is not None))


def with_meshes(head: FaceModel, fap: int, change: Callable[[FaceDefMesh], FaceDefMesh | None]) -> FaceModel:
    def changed(table: FaceDefTables) -> FaceDefTables:
        meshes = [change(mesh) for mesh in table.meshes]
        return replace(table, meshes=tuple(mesh for mesh in meshes if mesh is not None))

    return with_table(head, fap, changed)


def scaled(factor: float) -> Callable[[FaceDefMesh], FaceDefMesh]:
    return lambda mesh: replace(mesh, displacements=mesh.displacements * np.float32(factor))


def added(head: FaceModel, fap: int, point: str, step: tuple[float, float, float]) -> FaceModel:
    """The vertex of a feature point moves by `step` more, straight."""
    number = int(head.bound[point_rows()[point]])
    part = next(p for p in reversed(head.parts) if head.starts[p.name] <= number)
    own = number - head.starts[part.name]

    def changed(table: FaceDefTables) -> FaceDefTables:
        mesh = next((m for m in table.meshes if m.part == part.name), None)
        if mesh is None:
            more = FaceDefMesh(part.name, np.array([-1, 0, 1]), np.array([own]), np.array([[step, step]]))
            return replace(table, meshes=(*table.meshes, more))
        moves = np.array(mesh.displacements)
        vertices = np.array(mesh.vertices)
        if own not in vertices:
            vertices = np.append(vertices, own)
            moves = np.concatenate([moves, np.zeros((1, *moves.shape[1:]), dtype=np.float32)])
        moves[np.flatnonzero(vertices == own)[0]] += np.array(step, dtype=np.float32)
        others = tuple(m for m in table.meshes if m.part != part.name)
        return replace(table, meshes=(*others, FaceDefMesh(part.name, mesh.borders, vertices, moves)))

    return with_table(head, fap, changed)


def rules(findings: list[Finding]) -> list[str]:
    return [finding.rule for finding in findings]


def test_the_whole_model_is_fine(head: FaceModel) -> None:
    assert check_faps(head) == []


def test_findings_about_the_same_tables_are_shared_and_no_others(head: FaceModel) -> None:
    """A mixture of two models' tables is judged as if neither had been checked before."""
    broken = with_meshes(with_meshes(head, 31, scaled(1.3)), 19, scaled(0.5))
    mixed = with_table(head, 31, lambda table: broken.table_of[31])
    lost = head.with_tables(tuple(table for table in head.tables if table.fap != 19), {19: "no lid"})
    poser = Poser(head)
    checked = (4, 19, 21, 31)
    assert check_posed(poser, checked) == []
    for model, subjects in ((broken, {"FAP 19", "FAP 31"}), (mixed, {"FAP 31"}), (lost, set())):
        poser = Poser(model, like=poser)
        findings = check_posed(poser, checked)
        assert findings == check_faps(model, checked)
        assert {finding.subject[:6] for finding in findings} == subjects


@pytest.mark.parametrize("fap", [2, 69, 0, -5])
def test_only_low_level_faps_can_be_checked(head: FaceModel, fap: int) -> None:
    with pytest.raises(OptionError, match=f"FAP {fap} cannot be checked"):
        check_faps(head, [fap])


@pytest.mark.parametrize("fap", [3, 4, 6, 19, 31, 39, 44, 51, 63, 65])
def test_a_point_that_goes_too_far(head: FaceModel, fap: int) -> None:
    found = check_faps(with_meshes(head, fap, scaled(1.2)), [fap])
    assert any("moves by value" in rule for rule in rules(found))
    assert all(finding.severity == "error" for finding in found)


@pytest.mark.parametrize("fap", [4, 6, 12, 31, 41, 61, 67])
def test_a_point_that_goes_the_wrong_way(head: FaceModel, fap: int) -> None:
    found = check_faps(with_meshes(head, fap, scaled(-1)), [fap])
    assert any("moves by value" in rule for rule in rules(found))


def test_a_point_that_drifts_sideways(head: FaceModel) -> None:
    found = check_faps(added(head, 4, "2.2", (0.2, 0, 0)), [4])
    assert any(f.rule.startswith("2.2 moves by value") and f.subject == "FAP 4 lower_t_midlip" for f in found)


def test_a_mate_that_comes_along(head: FaceModel) -> None:
    assert "4.2, the mate, stays" in rules(check_faps(added(head, 31, "4.2", (0, 0.1, 0)), [31]))


def test_something_far_away_that_moves(head: FaceModel) -> None:
    found = check_faps(added(head, 63, "11.1", (0, 0.5, 0)), [63])
    region = next(finding for finding in found if finding.rule == "nothing moves outside its region")
    assert f"vertex {head.bound[point_rows()['11.1']]}" in region.found


def test_triangles_that_turn_over(head: FaceModel) -> None:
    def endless(mesh: FaceDefMesh) -> FaceDefMesh:
        """The first intervals go on for ever."""
        zero = int(np.flatnonzero(mesh.borders == 0)[0])
        return FaceDefMesh(
            mesh.part, np.array([-1, 0, 1]), mesh.vertices, mesh.displacements[:, zero - 1 : zero + 1]
        )

    found = check_faps(with_meshes(head, 31, endless), [31])
    assert "no triangle turns over at the limits of its range" in rules(found)
    assert "1800" in found[0].found


def test_triangles_that_explode(head: FaceModel) -> None:
    found = check_faps(added(head, 39, "5.3", (0, 0, 3.0)), [39])
    assert "no triangle explodes at the limits of its range" in rules(found)


def test_lids_that_do_not_meet(head: FaceModel) -> None:
    found = check_faps(with_meshes(head, 21, scaled(0.96)), [19, 21])
    assert rules(found) == ["lids meet where their values add up to 1024"]


def test_a_lid_that_cuts_the_eyeball(head: FaceModel) -> None:
    def straight(mesh: FaceDefMesh) -> FaceDefMesh:
        moves = np.array(mesh.displacements)
        moves[:, :, 2] = 0
        return replace(mesh, displacements=moves)

    assert "lids do not cut the eyeball" in rules(check_faps(with_meshes(head, 19, straight), [19]))


def test_lips_that_part_although_they_go_together(head: FaceModel) -> None:
    assert "lips stay in touch where top and bottom add up to 0" in rules(
        check_faps(with_meshes(head, 8, scaled(0.3)), [8])
    )


@pytest.mark.parametrize("point", ["2.2", "2.3", "8.1", "9.10"])
def test_a_jaw_that_takes_along_what_should_stay(head: FaceModel, point: str) -> None:
    assert f"{point} stays" in rules(check_faps(added(head, 3, point, (0, -0.3, 0)), [3]))


@pytest.mark.parametrize(("part", "point"), [("lower teeth", "9.11"), ("tongue", "6.1")])
def test_a_jaw_that_leaves_teeth_or_tongue(head: FaceModel, part: str, point: str) -> None:
    model = with_meshes(head, 3, lambda mesh: None if mesh.part == part else mesh)
    found = rules(check_faps(model, [3]))
    assert f"{point} sinks with the jaw" in found
    assert ("teeth part" in found) == (part == "lower teeth")


def test_an_eyeball_that_turns_about_the_wrong_axis(head: FaceModel) -> None:
    def tilted(table: FaceDefTables) -> FaceDefTables:
        return replace(table, transforms=tuple(replace(t, amount=(0.2, 1, 0)) for t in table.transforms))

    assert "the eyeball turns left about its centre" in rules(check_faps(with_table(head, 23, tilted), [23]))


def test_an_eyeball_that_takes_the_other_along(head: FaceModel) -> None:
    def both(table: FaceDefTables) -> FaceDefTables:
        return replace(table, transforms=(*table.transforms, replace(table.transforms[0], part="right eye")))

    assert "the other eyeball stays" in rules(check_faps(with_table(head, 25, both), [25]))


def test_a_thrust_in_another_direction(head: FaceModel) -> None:
    def up(table: FaceDefTables) -> FaceDefTables:
        return replace(table, transforms=(FaceDefTransform("left eye", "translation", (0, 1, 0)),))

    assert "3.5 moves by value x ES forward" in rules(check_faps(with_table(head, 27, up), [27]))


def test_a_pupil_that_grows_too_fast(head: FaceModel) -> None:
    found = check_faps(with_meshes(head, 29, scaled(1.5)), [29])
    assert "the pupil's diameter grows by value x IRISD" in rules(found)


def test_a_tongue_that_rolls_down(head: FaceModel) -> None:
    found = check_faps(with_meshes(head, 47, scaled(-1)), [47])
    assert {"6.3 turns up about the tongue's middle", "6.4 turns up about the tongue's middle"} <= set(
        rules(found)
    )


def test_a_head_that_turns_the_wrong_way_or_about_another_point(head: FaceModel) -> None:
    def wrong(table: FaceDefTables) -> FaceDefTables:
        return replace(table, transforms=(replace(table.transforms[0], amount=(0, -1, 0), centre=(0, 0, 0)),))

    found = check_faps(with_table(head, 49, wrong), [49])
    assert [finding.severity for finding in found] == ["error", "warning"]
    assert rules(found) == ["the head turns left by value x 1e-5 rad", "the head turns about 7.1"]


def test_a_fap_without_tables_needs_a_reason(head: FaceModel) -> None:
    without = with_table(head, 18, lambda table: None)
    assert rules(check_faps(without, [18])) == ["it has tables or a reason"]
    assert check_faps(replace(without, lost={18: "no chin"}), [18]) == []


def test_a_finding_reads_well() -> None:
    finding = Finding("FAP 4 lower_t_midlip", "it moves", "0 mm", "1 mm", "warning")
    assert str(finding) == "warning: FAP 4 lower_t_midlip: it moves: found 0 mm, expected 1 mm"
