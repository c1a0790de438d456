"""Entries of corrections.toml that name something that does not exist."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.site.corrections.test_file import EXAMPLE, KEY, corrections_of
from tests.site.site import write_survey
from tests.walks import landmarks_at
from vislam2tag.common.findings import Severity
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.corrections.unknown import unknown_landmarks, unused_corrections
from vislam2tag.site.model import SessionKey, Site


def test_entries_for_landmarks_of_a_floor_without_sessions_may_have_an_effect(tmp_path: Path) -> None:
    marks = landmarks_at({"10": (1, 1)})
    marks.floor[:] = 3
    site = Site((), marks)
    entry = "[[move_landmark]]\nid = 10\nfloor = {}\nx = 5\ny = 6\n"
    assert unused_corrections(corrections_of(tmp_path, entry.format(3)), [KEY], site) == []
    assert len(unused_corrections(corrections_of(tmp_path, entry.format(4)), [KEY], site)) == 1


def test_a_floor_that_lacks_the_landmark_is_a_finding(tmp_path: Path) -> None:
    survey = open_survey(write_survey(tmp_path, {}))
    entry = f"[[set_landmark_floor]]\nid = {survey.site.landmarks.ids[0]!r}\nto = 77\n"
    keys = [ref.key for ref in survey.sessions]
    (finding,) = unused_corrections(corrections_of(tmp_path, entry), keys, survey.site)
    assert "in the file of floor 77" in finding.message
    known = entry.replace("77", str(survey.site.landmarks.floor[0]))
    assert unused_corrections(corrections_of(tmp_path, known), keys, survey.site) == []


def test_entries_that_match_nothing_are_findings(tmp_path: Path) -> None:
    text = EXAMPLE + "[[move_landmark]]\nid = '99'\nx = 1\ny = 2\n"
    survey = open_survey(write_survey(tmp_path, {"corrections.toml": text}))
    messages = [finding.message for finding in survey.findings if finding.kind == "unknown_in_corrections"]
    assert len(messages) == 1
    assert "[[move_landmark]] number 2 has no effect: there is no landmark 99 in the files" in messages[0]
    corrections = corrections_of(tmp_path, EXAMPLE + "[[shift_clock]]\nfloor = 9\ntable = 'wifi'\noffset_s = 1\n")
    findings = unused_corrections(corrections, [ref.key for ref in survey.sessions], survey.site)
    assert "[[shift_clock]] number 2 has no effect: no session is of floor 9" in findings[-1].message


def test_landmarks_that_may_have_been_seen_without_being_surveyed_are_no_findings(tmp_path: Path) -> None:
    text = "[[exclude_landmark]]\nid = '99'\n[[swap_landmarks]]\nids = ['98', '99']\n"
    assert open_survey(write_survey(tmp_path, {"corrections.toml": text})).findings == ()


NAMED = SessionKey(1, "Pixel 6", "hall")


@pytest.mark.parametrize(
    ("selector", "problem"),
    [
        ("session = 'hal'", "there is no session hal; the closest is hall:"),
        ("device = 'pixel6'", "there is no device pixel6; the closest is Pixel 6:"),
        ("floor = 11", "no session is of floor 11; the closest is 1:"),
        ("session = 'x'", "there is no session x; correct"),
    ],
)
def test_the_name_that_no_session_has_is_an_error_with_the_closest_one(
    tmp_path: Path, selector: str, problem: str
) -> None:
    corrections = corrections_of(tmp_path, f"[[exclude_session]]\n{selector}\n")
    (finding,) = unused_corrections(corrections, [NAMED], Site((), landmarks_at({})))
    assert (finding.kind, finding.severity) == ("unknown_in_corrections", Severity.ERROR)
    assert f"[[exclude_session]] number 1 has no effect: {problem}" in finding.message


def test_existing_names_that_belong_to_different_sessions_are_a_warning(tmp_path: Path) -> None:
    corrections = corrections_of(tmp_path, "[[exclude_session]]\ndevice = 'LG'\nsession = 'hall'\n")
    (finding,) = unused_corrections(corrections, [KEY, NAMED], Site((), landmarks_at({})))
    assert (finding.kind, finding.severity) == ("unused_correction", Severity.WARNING)


def test_landmarks_of_logs_that_neither_a_file_nor_a_walk_has_are_errors(tmp_path: Path) -> None:
    text = (
        "[[exclude_landmark]]\nid = 'l2'\n[[swap_landmarks]]\nids = ['3', '14']\n[[rename_landmark]]\nid='5'\nto='6'\n"
    )
    corrections, site = corrections_of(tmp_path, text), Site((), landmarks_at({"12": (0, 0), "3": (1, 1)}))
    found = unknown_landmarks(corrections, site, {"14"}, ["8 rows of landmark 5 are assigned to 6."])
    assert [(each.kind, each.message.partition(":")[0]) for each in found] == [
        ("unknown_in_corrections", "[[exclude_landmark]] number 1 has no effect")
    ]
    assert "landmark l2; the closest is 12:" in found[0].message
    assert len(unknown_landmarks(corrections, site, (), ())) == 3
