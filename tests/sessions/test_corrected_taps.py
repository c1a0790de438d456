"""Taps of a walk without tracker, corrected: what each entry changes, and what ``process`` makes of it."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.sessions.test_without_poses import session_folder, simulated
from vislam2tag.common.errors import SurveyError
from vislam2tag.core.context import FixLog
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.run.selection import session_task
from vislam2tag.sessions.corrected_taps import _with_tap
from vislam2tag.sessions.prepared import PreparedSession, prepared_session
from vislam2tag.sessions.registry import open_survey
from vislam2tag.settings import Settings
from vislam2tag.site.corrections.edits import corrections_of
from vislam2tag.site.corrections.file import SetTap, read_corrections


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey with one walk of four taps."""
    return simulated(tmp_path_factory.mktemp("taps") / "survey")


@pytest.fixture
def survey(walked: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(walked, tmp_path / "survey"))


def prepared(survey: Path, entries: str = "") -> PreparedSession:
    (survey / "corrections.toml").write_text(entries, encoding="utf-8")
    opened = open_survey(survey)
    return prepared_session(session_task(opened.sessions[0], opened, read_corrections(survey), Settings()))


def entry(survey: Path, at_s: float, place: tuple[float, float] | None = None) -> str:
    """Of the survey's walk."""
    lines = ["[[set_tap]]", f'session = "{session_folder(survey).name}"', f"at_s = {at_s}"]
    return "\n".join([*lines, *(() if place is None else (f"x = {place[0]}", f"y = {place[1]}"))]) + "\n"


def taps(found: PreparedSession) -> tuple[FixLog, list[float]]:
    """Fixes, and their seconds since the first frame."""
    camera = found.session.camera
    assert camera.fixes is not None
    return camera.fixes, ((camera.fixes.time_ns - camera.time_ns[0]) * 1e-9).tolist()


def test_taps_are_placed_moved_and_taken_out(survey: Path) -> None:
    before, at_s = taps(prepared(survey))
    assert len(at_s) == 4
    between = round((at_s[1] + at_s[2]) / 2, 2)
    text = entry(survey, between, (1, 2)) + entry(survey, round(at_s[0], 1), (3, 4)) + entry(survey, round(at_s[3], 1))
    found = prepared(survey, text)
    after, then_s = taps(found)
    assert then_s == pytest.approx([at_s[0], at_s[1], between, at_s[2]])
    assert after.position_bcs.tolist() == [
        [3, 4],
        before.position_bcs[1].tolist(),
        [1, 2],
        before.position_bcs[2].tolist(),
    ]
    assert after.name == (f"tap at {round(at_s[0], 1):g} s", before.name[1], f"tap at {between:g} s", before.name[2])
    assert found.corrections == (
        f"The walk is taken to be at (1, 2) at {between:g} s.",
        f"The walk is taken to be at (3, 4) at {round(at_s[0], 1):g} s.",
        f"The tap at {round(at_s[3], 1):g} s is left out.",
    )
    nothing = prepared(survey, entry(survey, between))
    assert nothing.corrections == ()
    assert taps(nothing)[1] == at_s


def test_too_few_are_told_of_what_is_left(survey: Path) -> None:
    _, at_s = taps(prepared(survey))
    found = prepared(survey, "".join(entry(survey, round(one, 2)) for one in at_s[1:]))
    assert [finding.kind for finding in found.session.findings] == ["too_few_fixes"]
    (session_folder(survey) / "fixes.csv").write_text("100; 1.0; 2.0\n", encoding="utf-8")
    placed = prepared(survey, entry(survey, 5, (1, 2)) + entry(survey, 25, (3, 4)))
    assert placed.session.findings == ()


def test_a_moved_tap_spoils_labels_until_its_correction_and_undo_brings_that_back(survey: Path, tmp_path: Path) -> None:
    fixes, at_s = taps(prepared(survey))
    good = labels(survey, tmp_path)
    file = session_folder(survey) / "fixes.csv"
    lines = file.read_text(encoding="utf-8").splitlines()
    right = fixes.position_bcs[1].tolist()
    wrong = [
        f"{fixes.time_ns[1]}; {right[0] + 6}; {right[1]}" if str(fixes.time_ns[1]) in line else line for line in lines
    ]
    assert wrong != lines
    file.write_text("\n".join(wrong) + "\n", encoding="utf-8")
    assert np.nanmax(np.abs(labels(survey, tmp_path) - good)) > 1
    (survey / "corrections.toml").write_text(entry(survey, round(at_s[1], 2), right), encoding="utf-8")
    assert labels(survey, tmp_path) == pytest.approx(good, abs=1e-6, nan_ok=True)
    (survey / "corrections.toml").unlink()
    assert np.nanmax(np.abs(labels(survey, tmp_path) - good)) > 1


def test_a_walk_without_any_tap_is_walked_from_those_that_are_placed(survey: Path, tmp_path: Path) -> None:
    fixes, at_s = taps(prepared(survey))
    good = labels(survey, tmp_path)
    (session_folder(survey) / "fixes.csv").unlink()
    places = zip(at_s, fixes.position_bcs.tolist(), strict=True)
    text = "".join(entry(survey, t, (x, y)) for t, (x, y) in places)
    (survey / "corrections.toml").write_text(text, encoding="utf-8")
    assert labels(survey, tmp_path) == pytest.approx(good, abs=1e-3, nan_ok=True)


def labels(survey: Path, folder: Path) -> np.ndarray:
    """Places (n, 2) of the walk's frames, as ``process`` labels them."""
    assert process(survey, folder / "labels").failed == 0
    (table,) = (folder / "labels" / "trajectory").glob("*.parquet")
    return pl.read_parquet(table).select("x", "y").to_numpy()


def test_half_a_place_is_refused() -> None:
    with pytest.raises(SurveyError, match="x and y are both needed"):
        corrections_of('[[set_tap]]\nsession = "a"\nat_s = 1.0\nx = 2.0\n')


def test_other_taps_keep_their_sigma() -> None:
    fixes = FixLog(np.array((0, 10**10, 2 * 10**10)), np.zeros((3, 2)), ("a", "b", "c"), np.array((0.5, 0.6, 0.7)))
    moved = _with_tap(fixes, SetTap(session="s", at_s=10.0, x=1.0, y=2.0), 0, [])
    assert moved.sigma_m is not None
    assert moved.sigma_m.tolist() == pytest.approx([0.5, np.nan, 0.7], nan_ok=True)
    left = _with_tap(fixes, SetTap(session="s", at_s=10.0), 0, [])
    assert left.sigma_m is not None
    assert left.sigma_m.tolist() == [0.5, 0.7]
