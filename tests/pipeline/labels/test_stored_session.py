"""Surveys and outputs in object storage: the same bytes as on disk, nothing done twice, nothing trusted wrongly."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.cli.command import vislam2tag
from tests.stores import SECRET, Bucket, Fault
from tests.surveys import bytes_of, make_survey
from vislam2tag.common.errors import OutputError, StoreError, SurveyError
from vislam2tag.common.files import store as module
from vislam2tag.common.files.store import PROBE, Store
from vislam2tag.labeling.results import RUN_FILE
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.labels.session import Outcome, jobs_of
from vislam2tag.pipeline.run.output import LOGS, OutputFolder
from vislam2tag.pipeline.run.selection import session_task
from vislam2tag.sessions.inspection import inspect_survey
from vislam2tag.sessions.registry import open_survey
from vislam2tag.settings import Settings
from vislam2tag.site.corrections.file import read_corrections
from vislam2tag.site.stored_survey import survey_at_hand

REQUESTS_A_SESSION = 25


class Both(NamedTuple):
    """A survey on disk and in a bucket, and what processing it from disk to disk gives."""

    s3: Bucket
    local: Path
    stored: Path
    labels: Path

    def out(self, name: str) -> Path:
        return Path(self.s3.store(name).address)

    def process(self, name: str) -> dict[str, bool]:
        """Process from bucket to bucket; tell which sessions were repeated."""
        told: list[Outcome] = []
        process(self.stored, self.out(name), SETTINGS, progress=lambda outcome, _: told.append(outcome))
        return {outcome.slug: outcome.repeated for outcome in told}


SETTINGS = Settings(strategy="local-corrected")


@pytest.fixture(scope="module")
def survey(s3: Bucket, tmp_path_factory: pytest.TempPathFactory) -> Both:
    folder = tmp_path_factory.mktemp("stored")
    local = make_survey(folder / "survey", floors=2, devices=("LG",), seconds=20.0)
    process(local, folder / "labels", SETTINGS)
    return Both(s3, local, s3.upload(local, "group/survey"), folder / "labels")


@pytest.fixture(autouse=True)
def no_faults_left(s3: Bucket) -> Iterator[None]:
    yield
    s3.fail()


def test_from_bucket_to_bucket_is_as_from_disk_to_disk(survey: Both, tmp_path: Path) -> None:
    survey.s3.seen()
    assert list(survey.process("first").values()) == [True, True]
    requests = survey.s3.seen()
    assert bytes_of(survey.s3.download("first", tmp_path / "there")) == bytes_of(survey.labels)
    for ref in open_survey(survey.local).sessions:
        folder = ref.folder.relative_to(survey.local).as_posix()
        of_session = [request for request in requests if ref.slug in request or folder in request]
        assert 10 < len(of_session) <= REQUESTS_A_SESSION, of_session
    assert set(survey.process("first").values()) == {False}
    again = survey.s3.seen()
    written = [request for request in again if request.startswith("PUT") and "probe" not in request]
    assert sorted(written) == ["PUT /bucket/first/report.html", "PUT /bucket/first/summary.json"]
    assert not [request for request in again if "poses.csv" in request], "nothing is read to see that nothing changed"
    lines = content(survey.s3.store("first"), f"{LOGS}/{slug_of(survey)}.jsonl").splitlines()
    events = [json.loads(line) for line in lines]
    assert [event["event"] for event in events] == ["started", "ended"]
    assert {event["session"] for event in events} == {slug_of(survey)}
    assert events[-1]["error"] is None
    assert events[0]["time"] <= events[-1]["time"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["azure", "google"])
def test_in_other_stores_it_is_as_on_disk(
    survey: Both, kind: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    other: Bucket = request.getfixturevalue(kind)
    both = survey._replace(s3=other, stored=other.upload(survey.local, "group/survey"))
    assert list(both.process("first").values()) == [True, True]
    assert bytes_of(other.download("first", tmp_path / "there")) == bytes_of(survey.labels)
    assert set(both.process("first").values()) == {False}


def test_what_changed_is_repeated_and_what_is_touched_is_not(survey: Both, tmp_path: Path) -> None:
    store, out = survey.s3.store("changed-survey"), survey.s3.store("changed")
    survey.s3.upload(survey.local, "changed-survey")
    both = survey._replace(stored=Path(store.address))
    both.process("changed")
    slug = slug_of(survey)
    out.put(f"wifi/{slug}.parquet", b"spoilt by another program")
    assert [name for name, repeated in both.process("changed").items() if repeated] == [slug]
    out.delete([f"sensors/{slug}.parquet"])
    assert [name for name, repeated in both.process("changed").items() if repeated] == [slug]
    raw = next(file.name for file in store.list("floor_0") if file.name.endswith("wifi.csv"))
    before = content(store, raw)
    store.put(raw, b"".join(before.splitlines(keepends=True)[:-1]))
    assert [name for name, repeated in both.process("changed").items() if repeated] == [slug]
    store.put(raw, before)
    both.process("changed")
    there = bytes_of(survey.s3.download("changed", tmp_path / "there"))
    labels = bytes_of(survey.labels)
    assert {name for name in there if there[name] != labels[name]} <= {RUN_FILE, "report.html"}, "the survey's name"


def test_disk_and_bucket_may_be_mixed(survey: Both, tmp_path: Path) -> None:
    process(survey.stored, tmp_path / "labels", SETTINGS)
    assert bytes_of(tmp_path / "labels") == bytes_of(survey.labels)
    process(survey.local, survey.out("mixed"), SETTINGS)
    assert bytes_of(survey.s3.download("mixed", tmp_path / "there")) == bytes_of(survey.labels)


@pytest.mark.slow
@pytest.mark.parametrize("answer", ["503 SlowDown", "500 InternalError", "torn", "lost", "silent"])
def test_faults_of_the_store_change_nothing(
    survey: Both, tmp_path: Path, answer: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if answer == "silent":
        monkeypatch.setattr(module, "_TIMEOUT_S", 1.0)
        module.connection_to.cache_clear()
    name = f"faulty-{answer.split()[0]}"
    survey.s3.fail(
        Fault(f"PUT /bucket/{name}/sessions", answer),
        Fault("GET /bucket/group/survey/.*poses", answer, 2),
        Fault(f"PUT /bucket/{name}/wifi", answer, 2),
        Fault(f"GET /bucket/{name}/sessions", answer, 2),
    )
    survey.process(name)
    module.connection_to.cache_clear()
    assert bytes_of(survey.s3.download(name, tmp_path / "there")) == bytes_of(survey.labels)


def test_a_mark_that_another_program_wrote_meanwhile_is_replaced(survey: Both, tmp_path: Path) -> None:
    survey.process("together")
    store = survey.s3.store("together")
    mark = next(file.name for file in store.list("sessions"))
    survey.s3.fail(Fault(f"PUT /bucket/together/{mark}", "412 PreconditionFailed"))
    store.delete([f"wifi/{Path(mark).stem}.parquet"])
    survey.process("together")
    assert bytes_of(survey.s3.download("together", tmp_path / "there")) == bytes_of(survey.labels)


@pytest.mark.slow
def test_two_runs_at_once_into_one_folder(survey: Both, tmp_path: Path) -> None:
    command = ("process", "s3://bucket/group/survey", "-o", "s3://bucket/both", "--strategy", "local-corrected")
    runs = [subprocess.Popen([sys.executable, "-m", "vislam2tag", *command, "--jobs", "1"]) for _ in range(2)]
    assert [run.wait() for run in runs] == [1, 1], "one of the sessions cannot be mapped"
    assert bytes_of(survey.s3.download("both", tmp_path / "there")) == bytes_of(survey.labels)
    assert set(survey.process("both").values()) == {False}


def test_what_another_run_looks_for_when_it_begins_is_no_content(survey: Both) -> None:
    survey.s3.store("begins").put(f"{PROBE}of-another", b"first")
    assert set(survey.process("begins").values()) == {True}


def test_a_run_that_began_after_the_first_look_is_joined(survey: Both) -> None:
    survey.process("begun")
    survey.s3.fail(Fault("GET /bucket/begun/run.json", "404 NoSuchKey"))
    assert set(survey.process("begun").values()) == {False}


def test_a_store_that_may_only_be_read_is_told_before_anything_is_done(survey: Both) -> None:
    survey.s3.fail(Fault("PUT /bucket/read-only", "403 AccessDenied", 99))
    with pytest.raises(StoreError, match=r"^s3://bucket/read-only/.*cannot be written: permission is denied: the cred"):
        survey.process("read-only")
    assert not list(survey.s3.store("read-only").list())


def test_what_another_command_or_program_wrote_is_refused(survey: Both) -> None:
    survey.s3.store("foreign").put("notes.txt", b"mine")
    with pytest.raises(OutputError, match=r"`vislam2tag process` did not create it .it contains notes.txt"):
        survey.process("foreign")
    survey.process("strategy")
    with pytest.raises(OutputError, match=r"^s3://bucket/strategy: .* labels of the strategy local-corrected"):
        process(survey.stored, survey.out("strategy"), Settings(strategy="local"))


def test_a_run_of_other_settings_that_takes_the_folder_is_told(survey: Both) -> None:
    out = survey.s3.store("taken")

    def take(outcome: Outcome, total: int) -> None:
        out.put(RUN_FILE, b"{}")

    with pytest.raises(OutputError, match="a run with other settings is writing to this folder"):
        process(survey.stored, survey.out("taken"), SETTINGS, progress=take)


def test_commands_take_addresses_and_tell_no_secret(survey: Both, tmp_path: Path) -> None:
    command = ("process", "s3://bucket/group/survey", "-o", "s3://bucket/command", "--strategy", "local-corrected")
    survey.s3.fail(Fault("PUT /bucket/command/wifi", "403 AccessDenied"), Fault("GET /bucket/command", "500 Internal"))
    failed = vislam2tag("-v", *command)
    assert "permission is denied" in failed.stderr
    done = vislam2tag("-v", *command)
    assert "report: s3://bucket/command/report.html" in done.stdout, done.stderr
    assert vislam2tag("verify", "s3://bucket/command", survey.labels).returncode == 0
    shown = vislam2tag("inspect", "s3://bucket/group/survey", "--json").stdout
    assert json.loads(shown)["sessions"] == inspect_survey(survey.local).model_dump(mode="json")["sessions"]
    there = survey.s3.store("command")
    texts = [content(there, file.name) for file in there.list()]
    printed = (failed.stdout + failed.stderr + done.stdout + done.stderr + shown).encode()
    with survey_at_hand(survey.stored) as root:
        opened = open_survey(root)
        tasks = [session_task(ref, opened, read_corrections(root), SETTINGS) for ref in opened.sessions]
        jobs = pickle.dumps(jobs_of(tasks, SETTINGS, OutputFolder(Path(there.address))))
    assert b"command" in jobs
    assert not any(SECRET.encode() in text for text in (*texts, printed, jobs))


def test_where_nothing_is_stored_there_is_no_survey(s3: Bucket) -> None:
    with pytest.raises(SurveyError, match=r"^s3://bucket/nowhere: nothing is stored there"):
        process(Path("s3://bucket/nowhere"), Path("s3://bucket/out"))


def slug_of(survey: Both) -> str:
    """The first session's."""
    return min(path.stem for path in (survey.labels / "sessions").iterdir())


def content(store: Store, name: str) -> bytes:
    found = store.get(name)
    assert found is not None, name
    return found.data
