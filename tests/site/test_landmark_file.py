"""One landmark file for all floors, in place of the floors' own.

Planned and measured landmarks: their file, what is about them, and surveys of before.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.site.site import write_survey
from vislam2tag.common.errors import OutputError, SurveyError
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.transforms import Similarity2
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.discover import read_site
from vislam2tag.site.frame_change import FrameChange
from vislam2tag.site.landmark_file import LANDMARK_FILE, refuse_unreadable
from vislam2tag.site.landmark_states import (
    LandmarkCounts,
    LandmarkState,
    StateRow,
    changed_states_text,
    planned_findings,
    read_states,
    write_states,
)

HEADER = "id,x,y,z,floor,sigma_m,heading_rad,heading_sigma_rad\n"


def completed(folder: Path, text: str) -> Path:
    path = folder / "completed.csv"
    path.write_text(text)
    return path


def test_it_replaces_the_floors_files_with_all_its_columns(tmp_path: Path) -> None:
    root = write_survey(tmp_path / "survey", {"floor_4/marker_dict.csv": None})
    file = completed(tmp_path, HEADER + "10,1.25,2,1.5,1,0.04,0.5,0.1\n10,9,8,,4,,,\n12,,,,4,,,\n")
    survey = open_survey(root, 0.05, file)
    marks = survey.site.landmarks
    assert survey.findings == ()
    assert list(zip(marks.floor.tolist(), marks.ids, strict=True)) == [(1, "10"), (4, "10"), (4, "12")]
    assert marks.position_bcs[:2].tolist() == [[1.25, 2.0], [9.0, 8.0]]
    np.testing.assert_allclose(marks.covariance_bcs[:, 0, 0], [0.04**2, 0.05**2, np.inf])
    np.testing.assert_array_equal(marks.z_m, [1.5, np.nan, np.nan])
    np.testing.assert_array_equal(marks.heading_rad, [0.5, np.nan, np.nan])
    assert marks.surveyed.tolist() == [True, True, False]
    assert marks.source == ("completed.csv:2", "completed.csv:3", "completed.csv:4")


def test_one_floor_needs_no_column_floor(tmp_path: Path) -> None:
    root = tmp_path / "survey"
    (write_survey(root) / "floor_4").rename(tmp_path / "elsewhere")
    marks = open_survey(root, landmark_file=completed(tmp_path, "id,x,y\n3,1,2\n")).site.landmarks
    assert (marks.ids, marks.floor.tolist()) == (("3",), [1])


def test_rows_that_cannot_be_used_are_findings_at_their_lines(tmp_path: Path) -> None:
    file = completed(tmp_path, "id,x,y,floor\n1,1,1,1\n2,1,1,\n3,1,1,one\n1,5,5,1\n4,1,inf,4\n")
    survey = open_survey(write_survey(tmp_path / "survey"), landmark_file=file)
    assert {(finding.kind, finding.file): finding.lines for finding in survey.findings} == {
        ("malformed_lines", "completed.csv"): (3, 4),
        ("duplicate_landmarks", "completed.csv"): (5,),
        ("non_finite_values", "completed.csv"): (6,),
    }
    assert survey.site.landmarks.ids == ("1",)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, r"completed\.csv: cannot be opened \(No such file or directory\); expected a landmark file"),
        ("", r"completed\.csv: the first line must be: id,x,y .*; it does not contain x and y and is: empty"),
        ("id,x,y\n1,1,1\n", r"completed\.csv: the column floor is missing, which .* several floors needs"),
        (HEADER, r"completed\.csv: contains no usable landmark of the survey's floors \(1, 4\)"),
        ("id,x,y,floor\n1,1,1,7\n2,a,b,1\n", r"contains no usable landmark of the survey's floors \(1, 4\)"),
    ],
)
def test_a_file_that_cannot_serve_is_refused(tmp_path: Path, text: str | None, message: str) -> None:
    file = tmp_path / "completed.csv" if text is None else completed(tmp_path, text)
    with pytest.raises(SurveyError, match=message):
        open_survey(write_survey(tmp_path / "survey"), landmark_file=file)


PLANNED = "id,x,y,sigma_m,heading_rad,heading_sigma_rad,sheet,width_m\n"
ROW = "{},{},{},0.1,0.5,0.05,A4,0.19\n"


def survey(root: Path, table: str) -> Path:
    (root / "floor_1").mkdir(parents=True)
    (root / "floor_dimensions.csv").write_text("id,width,height\n1,20,10\n")
    (root / "floor_1" / "marker_dict.csv").write_text(table)
    return root


def kinds(root: Path) -> list[str]:
    return [finding.kind for finding in read_site(root)[1] if finding.kind != "missing_plan"]


def test_planned_until_the_table_says_something_else(tmp_path: Path) -> None:
    root = survey(tmp_path / "s", "id,x,y\n1,1,2\n2,3,4\n3,,\n4,5,6\n")
    plan = [StateRow(name, LandmarkState.PLANNED, "plan", x, y) for name, x, y in (("1", 1, 2), ("2", 3, 4.2))]
    write_states(root, root / "floor_1", plan)
    marks = read_site(root)[0].landmarks
    assert marks.planned_ids == ("1",), "2 was moved by hand since"
    assert str(LandmarkCounts.of(marks)) == "4 landmarks: 2 measured, 1 planned, 1 without position"
    used = marks.without_planned_positions()
    assert used.surveyed_ids == {"2", "4"}
    assert used.planned_ids == ("1",)
    assert str(LandmarkCounts.of(used)) == str(LandmarkCounts.of(marks))
    (finding,) = planned_findings(marks, use_planned=False)
    assert "landmarks 1 come from vislam2tag plan" in finding.message
    assert "--use-planned" in finding.message
    measured = StateRow("1", LandmarkState.MEASURED, "station", 1, 2)
    write_states(root, root / "floor_1", [measured])
    assert read_site(root)[0].landmarks.planned_ids == ()
    assert set(read_states(root, root / "floor_1")[0]) == {"1", "2"}


PLACES = {"1": (1.237, 2.412), "2": (3.861, 4.049), "3": (7.504, 1.118), "4": (9.555, 6.445)}


def planned_survey(root: Path, decimals: int, sigma: str = "0.1") -> Path:
    """A floor whose landmarks are planned, and whose table was saved again with fewer decimals."""
    rows = (f"{name},{x:.{decimals}f},{y:.{decimals}f},{sigma}\n" for name, (x, y) in PLACES.items())
    survey(root, "id,x,y,sigma_m\n" + "".join(rows))
    plan = [StateRow(name, LandmarkState.PLANNED, "plan", x, y) for name, (x, y) in PLACES.items()]
    write_states(root, root / "floor_1", plan)
    return root


@pytest.mark.parametrize("sigma", ["0.1", ""])
def test_a_planned_table_saved_with_two_decimals_stays_planned(sigma: str, tmp_path: Path) -> None:
    root = planned_survey(tmp_path / "s", 2, sigma)
    assert read_site(root)[0].landmarks.planned_ids == tuple(PLACES)
    assert kinds(root) == []


def test_positions_that_may_be_rounded_or_measured_are_reported(tmp_path: Path) -> None:
    root = planned_survey(tmp_path / "s", 1)
    (finding,) = (one for one in read_site(root)[1] if one.kind == "perhaps_planned")
    assert (finding.file, finding.lines) == ("floor_1/marker_dict.csv", (2, 3, 4, 5))
    assert "measured, or rounded?" in finding.message
    assert kinds(planned_survey(tmp_path / "measured", 1, "0.004")) == [], "someone wrote how well it is measured"


def with_file(root: Path, text: str) -> tuple[tuple[str, ...], list[str]]:
    """Which landmarks are planned, and kinds of findings, with a landmark file in place of the survey's."""
    file = root.parent / "given.csv"
    file.write_text(text)
    site, findings = read_site(root, landmark_file=file)
    return site.landmarks.planned_ids, [one.kind for one in findings if one.kind != "missing_plan"]


def test_a_landmark_file_that_repeats_planned_positions_is_planned(tmp_path: Path) -> None:
    root = planned_survey(tmp_path / "s", 3)
    text = (root / "floor_1" / "marker_dict.csv").read_text()
    assert with_file(root, text) == (tuple(PLACES), [])
    assert with_file(root, text.replace(",0.1", "")) == (tuple(PLACES), []), "no sigma"
    assert with_file(root, text.replace(",0.1", ",0.02")) == (tuple(PLACES), []), "the very places"
    rounded = "id,x,y,floor\n" + "".join(f"{name},{x:.2f},{y:.2f},1\n" for name, (x, y) in PLACES.items())
    assert with_file(root, rounded) == (tuple(PLACES), [])
    assert with_file(root, planned_table(1)) == ((), ["perhaps_planned"])


def planned_table(decimals: int) -> str:
    return "id,x,y\n" + "".join(f"{name},{x:.{decimals}f},{y:.{decimals}f}\n" for name, (x, y) in PLACES.items())


def test_a_landmark_file_with_other_or_better_positions_is_measured(tmp_path: Path) -> None:
    root = planned_survey(tmp_path / "s", 3)
    by_walks = "".join(f"{name},{x + 0.006},{y},0.034\n" for name, (x, y) in PLACES.items())
    assert with_file(root, "id,x,y,sigma_m\n" + by_walks) == ((), [])
    elsewhere = "".join(f"{name},{x + 0.3},{y},0.1\n" for name, (x, y) in PLACES.items())
    assert with_file(root, "id,x,y,sigma_m\n" + elsewhere) == ((), [])
    x, y = PLACES["1"]
    write_states(root, root / "floor_1", [StateRow("1", LandmarkState.MEASURED, "station", x, y)])
    assert with_file(root, planned_table(3))[0] == ("2", "3", "4"), "1 was measured to be where it was planned"


def test_a_landmark_file_is_compared_with_a_plan_of_before(tmp_path: Path) -> None:
    root = survey(tmp_path / "s", "id,x,y\n")
    landmarks = [{"id": name, "floor": 1, "x_m": x, "y_m": y} for name, (x, y) in PLACES.items()]
    (root / "plan.json").write_text(json.dumps({"floors": [{"landmarks": landmarks}]}))
    assert with_file(root, planned_table(3))[0] == tuple(PLACES)
    assert with_file(root, "id,x,y\n1,5,5\n") == ((), [])


def twice(root: Path, measured: str) -> list[Finding]:
    """Findings about a table with planned landmarks 1 to 4 and further rows."""
    survey(root, planned_table(3) + measured)
    plan = [StateRow(name, LandmarkState.PLANNED, "plan", x, y) for name, (x, y) in PLACES.items()]
    write_states(root, root / "floor_1", plan)
    return [one for one in read_site(root)[1] if one.kind != "missing_plan"]


def test_sheets_that_the_table_has_twice_are_named(tmp_path: Path) -> None:
    rows = "".join(f"LM{name},{x + 1.5:.3f},{y:.3f}\n" for name, (x, y) in PLACES.items())
    (finding,) = twice(tmp_path / "s", "7,18,9\n" + rows)
    assert (finding.kind, finding.severity, finding.lines) == ("duplicate_landmarks", Severity.ERROR, (7, 8, 9, 10))
    assert "landmarks LM1, LM2, LM3, LM4 are measured where landmarks 1, 2, 3, 4 are planned" in finding.message


def test_other_sheets_beside_planned_ones_are_usual(tmp_path: Path) -> None:
    assert twice(tmp_path / "far", "A1,18,9\nA2,19,1\nA3,17,7\n") == []
    assert twice(tmp_path / "next", "5,18,9\n6,19,1\n7,17,7\n8,16,9\n") == []
    assert twice(tmp_path / "named", "door,1,2\nlift,4,4\n") == []


def test_states_of_a_floor_in_another_frame(tmp_path: Path) -> None:
    root = survey(tmp_path / "s", "id,x,y\n1,1,2\n")
    write_states(root, root / "floor_1", [StateRow("1", LandmarkState.PLANNED, "plan", 1, 2)])
    text = changed_states_text(root, root / "floor_1", FrameChange.of(1, Similarity2(1j, 10 + 0j)))
    assert text is not None
    *start, y = text.splitlines()[1].split(",")
    assert start == ["1", "planned", "plan", "8.0"]
    assert float(y) == pytest.approx(1)
    assert changed_states_text(root, root / "floor_2", FrameChange.of(2, Similarity2.identity())) is None


def test_a_damaged_file_is_a_finding_and_is_not_replaced(tmp_path: Path) -> None:
    root = survey(tmp_path / "s", "id,x,y\n1,1,2\n")
    (root / "floor_1" / "landmark_states.csv").write_text("id,state,source,x,y\n1,perhaps,plan,1,2\n")
    assert kinds(root) == ["malformed_lines"]
    with pytest.raises(OutputError, match="nothing was written"):
        write_states(root, root / "floor_1", [])


def test_a_survey_of_before_whose_rows_are_as_a_plan_left_them(tmp_path: Path) -> None:
    table = PLANNED + ROW.format(1, 1.25, 2.5) + ROW.format(2, 3.0, 4.0)
    root = survey(tmp_path / "s", table)
    (finding,) = (one for one in read_site(root)[1] if one.kind == "perhaps_planned")
    assert (finding.count, finding.lines) == (2, (2, 3))
    (root / "plan").mkdir()
    proposed = [{"id": "1", "floor": 1, "x_m": 1.25, "y_m": 2.5}, {"id": "2", "floor": 1, "x_m": 9.0, "y_m": 4.0}]
    (root / "plan" / "plan.json").write_text(json.dumps({"floors": [{"landmarks": proposed}]}))
    (finding,) = (one for one in read_site(root)[1] if one.kind == "perhaps_planned")
    assert finding.lines == (2,), "2 was measured: the plan had it elsewhere"
    assert read_site(root)[0].landmarks.planned_ids == (), "that it is planned is not sure"


@pytest.mark.parametrize(
    "table",
    [
        "id,x,y\n1,1,2\n",
        "id,x,y,sigma_m,heading_sigma_rad\n1,1,2,0.1,0.05\n",
        PLANNED + "1,1,2,0.003,0.5,0.05,A4,0.19\n",
    ],
)
def test_measured_tables_get_no_finding(table: str, tmp_path: Path) -> None:
    root = survey(tmp_path / "s", table)
    assert kinds(root) == []
    assert np.isfinite(read_site(root)[0].landmarks.position_bcs).all()


def test_positions_that_the_reader_skips_are_not_written(tmp_path: Path) -> None:
    read = kinds_read(tmp_path, 999_999.0), kinds_read(tmp_path, 5_430_000.0)
    assert ["non_finite_values" in kinds for kinds in read] == [False, True]
    refuse_unreadable(tmp_path / LANDMARK_FILE, ["1"], np.array([(3.0, 999_999.0)]))
    with pytest.raises(OutputError, match=r"marker_dict.csv: nothing was written to it, because the coordinates of 1"):
        refuse_unreadable(tmp_path / LANDMARK_FILE, ["1"], np.array([(3.0, 5_430_000.0)]))


def kinds_read(folder: Path, y_m: float) -> set[str]:
    survey = write_survey(folder / f"{y_m:.0f}", {"floor_1/marker_dict.csv": f"id,x,y\n1,3,{y_m}\n"})
    return {finding.kind for finding in open_survey(survey).findings}
