"""Ids that walks logged, by what the session itself says and by what is kept of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.intake.faults import change_fields
from tests.surveys import make_survey
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.diagnose import observe_session
from vislam2tag.pipeline.labels.survey_evidence import kept_walk, passes_record
from vislam2tag.pipeline.run.selection import session_task
from vislam2tag.sessions.id_findings import walk_id_shift
from vislam2tag.sessions.prepared import prepared_session
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.corrections.file import Corrections

SETTINGS = ProcessSettings()


@pytest.mark.parametrize("seed", [500, 506])
@pytest.mark.parametrize("by", [0, 1, -1])
def test_session_diagnosis_and_what_is_kept_say_the_same(seed: int, by: int, tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "survey", devices=("LG",), seconds=120.0, severity="default", seed=seed)
    (session,) = survey.glob("floor_*/*/*/")
    change_fields("initPoses.csv", 0, lambda name: str(int(name) - by))(session)
    opened = open_survey(survey)
    task = session_task(opened.sessions[0], opened, Corrections(), SETTINGS)
    prepared = prepared_session(task)
    record = passes_record(prepared, SETTINGS.mapping.smoother.sighting_range_m)
    assert record is not None
    diagnosed = observe_session(SETTINGS, task).passes
    assert diagnosed is not None
    found = [
        walk_id_shift(prepared.session.camera, prepared.session.landmarks, prepared.landmarks),
        kept_walk(task.ref.key, record)[0].id_shift,
        diagnosed.id_shift,
    ]
    assert {None if one is None else one.shift for one in found} == {by or None}
    kinds = [finding.kind for finding in prepared.findings()]
    assert ("shifted_ids" in kinds) == (by != 0)
