"""What would run, and why: as process then does, and nothing is written."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.command import vislam2tag
from tests.stores import Bucket
from tests.surveys import bytes_of, make_survey
from vislam2tag.common.errors import OutputError
from vislam2tag.pipeline.labels.label_run import opened_run
from vislam2tag.pipeline.labels.process import dry_run, process
from vislam2tag.pipeline.labels.session import Reason, jobs_of
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.pipeline.run.selection import OpenedSurvey
from vislam2tag.settings import Settings

SETTINGS = Settings(strategy="local-corrected")
OTHER = SETTINGS.model_copy(update={"labels": SETTINGS.labels.model_copy(update={"max_gap_s": 0.2})})


@pytest.mark.parametrize("place", ["folder", "bucket"])
def test_each_session_that_would_run_is_told_with_why(
    place: str, s3: Bucket, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    survey, out = make_survey(tmp_path / "survey", sessions=2, devices=("LG",), seconds=20.0), tmp_path / "labels"
    if place == "bucket":
        out = Path(s3.store("dry-run").address)

    def planned(settings: Settings = SETTINGS) -> list[tuple[Reason, ...]]:
        return [one.reasons for one in dry_run(survey, out, settings)]

    def written() -> dict[str, str]:
        return bytes_of(s3.download("dry-run", tmp_path / "there") if place == "bucket" else out)

    assert planned() == [(Reason.NEW,), (Reason.NEW,)]
    assert not list(s3.store("dry-run").list())
    assert not (tmp_path / "labels").exists()
    process(survey, out, SETTINGS)
    before = written()
    assert planned() == [(), ()]
    assert planned(OTHER) == [(Reason.SETTINGS,), (Reason.SETTINGS,)]
    raw = min(survey.glob("floor_0/LG/*/wifi.csv"))
    content = raw.read_bytes()
    raw.write_bytes(b"".join(content.splitlines(keepends=True)[:-1]))
    assert planned() == [(Reason.INPUTS,), ()]
    assert planned(OTHER) == [(Reason.SETTINGS, Reason.INPUTS), (Reason.SETTINGS,)]
    raw.write_bytes(content)
    monkeypatch.setattr("vislam2tag.pipeline.labels.session.code_of", lambda *_: "another")
    assert planned() == [(Reason.CODE,), (Reason.CODE,)]
    monkeypatch.undo()
    (survey / "floor_0" / "marker_dict.csv").write_text("spoilt\n")
    assert planned() == [(Reason.INPUTS,), (Reason.INPUTS,)]
    assert written() == before


def test_what_failed_before_and_what_lost_its_tables_is_told(tmp_path: Path) -> None:
    survey, out = make_survey(tmp_path / "survey", devices=("LG",), sessions=2, seconds=20.0), tmp_path / "labels"
    process(survey, out, SETTINGS)
    run = opened_run(OpenedSurvey.at(survey, SETTINGS), OutputFolder(out))
    jobs_of(run.tasks, SETTINGS, run.folder)[0].given_up("3 workers died of it")
    max((out / "wifi").iterdir()).unlink()
    assert [one.reasons for one in dry_run(survey, out, SETTINGS)] == [(Reason.FAILED,), (Reason.LOST,)]


def test_labels_of_another_strategy_are_refused_as_by_process(tmp_path: Path) -> None:
    survey, out = make_survey(tmp_path / "survey", devices=("LG",), seconds=20.0), tmp_path / "labels"
    process(survey, out, SETTINGS)
    with pytest.raises(OutputError, match="the folder contains labels of the strategy local-corrected"):
        dry_run(survey, out, Settings(strategy="local"))
    done = vislam2tag("process", survey, "-o", out, "--strategy", "local-corrected", "--dry-run")
    assert done.stdout.splitlines()[0] == "0 of 1 sessions would be processed; the others are finished and unchanged"
