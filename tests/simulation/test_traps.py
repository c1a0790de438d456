"""Each trap, put into a clean survey, gives exactly its findings, by reading and by processing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.simulation.worlds import clean_scenario, sessions_of
from vislam2tag.common.errors import UsageError
from vislam2tag.pipeline.labels.process import process
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.settings import Settings
from vislam2tag.simulation.raw_files import session_text
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import TRAP_FINDINGS
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.simulation.traps import SITE_TRAPS, TABLE_TRAPS, TEXT_TRAPS, check_traps, trap_tables, trap_text

FOUND_BY_PROCESSING = frozenset({"landmark_without_position", "landmark_never_passed", "pose_lag", "too_few_landmarks"})
"""Kinds that need the whole pipeline; the reader alone finds the others."""
WITHOUT_PLAN = frozenset({"few_landmarks", "missing_markers"})
"""Traps for walks that no plan places."""
VISITS_ONLY = "high_landmark"
"""A trap for strategies that want landmarks passed within a radius in space."""


def trapped(out: Path, *traps: str) -> Path:
    simulate(clean_scenario(), out, WritingOptions(traps=frozenset(traps)))
    return out


def read_kinds(root: Path) -> set[str]:
    survey = open_survey(root)
    findings = list(survey.findings)
    for ref in survey.sessions:
        findings += read_session(ref).findings
    return {finding.kind for finding in findings}


def processed_kinds(root: Path, out: Path, strategy: str = Settings().strategy) -> set[str]:
    site = {finding.kind for finding in open_survey(root).findings}
    return site | set(process(root, out, Settings(strategy=strategy)).findings)


def test_every_trap_has_one_maker_and_its_findings() -> None:
    makers = [*TABLE_TRAPS, *TEXT_TRAPS, *SITE_TRAPS]
    assert sorted(makers) == sorted(TRAP_FINDINGS)


def test_a_clean_survey_has_no_findings(tmp_path: Path) -> None:
    root = trapped(tmp_path / "survey")
    assert read_kinds(root) == set()
    assert processed_kinds(root, tmp_path / "out") == set()


@pytest.mark.slow
@pytest.mark.parametrize("trap", TRAP_FINDINGS)
def test_reading_and_processing_find_the_trap(trap: str, tmp_path: Path) -> None:
    traps = {trap, "missing_plan"} if trap in WITHOUT_PLAN else {trap}
    expected = frozenset[str]().union(*(TRAP_FINDINGS[one] for one in traps))
    root = trapped(tmp_path / "survey", *traps)
    assert read_kinds(root) == expected - FOUND_BY_PROCESSING
    strategy = "local-corrected" if trap == VISITS_ONLY else Settings().strategy
    assert processed_kinds(root, tmp_path / "out", strategy) == expected


def test_a_plan_places_a_walk_in_the_trap_of_few_landmarks(tmp_path: Path) -> None:
    root = trapped(tmp_path / "survey", "few_landmarks")
    assert processed_kinds(root, tmp_path / "out") == {"placed_on_plan"}


def test_a_high_landmark_is_no_trap_for_the_smoother(tmp_path: Path) -> None:
    assert processed_kinds(trapped(tmp_path / "survey", VISITS_ONLY), tmp_path / "out", "smoother") == set()


def test_traps_add_up(tmp_path: Path) -> None:
    root = trapped(tmp_path, "garbage_lines", "frame_gap", "missing_plan", "decimal_comma")
    assert read_kinds(root) == {"malformed_lines", "frame_gap", "missing_plan"}


def test_traps_hold_for_every_session(tmp_path: Path) -> None:
    scenario = regular_survey(3, "none", (0,), ("LG", "OnePlus"), 1, 20.0)
    simulate(scenario, tmp_path, WritingOptions(traps=frozenset({"empty_file"})))
    assert [path.stat().st_size for path in tmp_path.rglob("wifi.csv")] == [0, 0]


def test_traps_take_a_session_in_which_nothing_was_seen() -> None:
    session = sessions_of("clean")[0]
    log, wifi = session.tracker.landmarks, session.wifi
    unseen = log.rows_kept(np.zeros(len(log.landmark), dtype=bool))
    unheard = wifi.rows(np.empty(0, dtype=np.int64))
    empty = replace(session, tracker=replace(session.tracker, landmarks=unseen), wifi=unheard)
    for trap in TRAP_FINDINGS:
        text = trap_text(session_text(trap_tables(empty, frozenset({trap}))), frozenset({trap}))
        assert text["poses"]


def test_an_unknown_trap_is_named() -> None:
    with pytest.raises(UsageError, match=r"no such trap: pitfall; traps are: decimal_comma, "):
        check_traps(["frame_gap", "pitfall"])


def test_the_documented_table_is_the_real_one() -> None:
    document = (Path(__file__).parents[2] / "docs" / "reference" / "simulator.md").read_text(encoding="utf-8")
    for trap, kinds in TRAP_FINDINGS.items():
        assert f"| {trap} | {', '.join(sorted(kinds)) or 'none'} |" in document
