"""Sessions on a Dask cluster: the same bytes, whatever is killed meanwhile; each worker that may not work, by name."""

from __future__ import annotations

import platform
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from tests.dask_processes import (
    OTHER_CODE,
    DaskProcesses,
    Nothing,
    OfThisWorker,
    dask_processes,
    do_nothing,
    pages_asked_for,
    run_or_die,
)
from tests.stores import ROOT, Bucket
from tests.surveys import bytes_of, make_survey
from vislam2tag.common.errors import OutputError
from vislam2tag.labeling.results import SessionResult
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.labels.session import Outcome
from vislam2tag.pipeline.run.dask import DaskExecutor, connected
from vislam2tag.pipeline.run.workers import Report
from vislam2tag.settings import Settings

SETTINGS = Settings(strategy="local-corrected")
pytest.importorskip("distributed")


class Survey(NamedTuple):
    """Four short sessions in a bucket, and what processing them from disk to disk gives."""

    s3: Bucket
    stored: Path
    labels: dict[str, str]


@pytest.fixture(scope="module")
def survey(s3: Bucket, tmp_path_factory: pytest.TempPathFactory) -> Survey:
    folder = tmp_path_factory.mktemp("dask")
    local = make_survey(folder / "walks", sessions=2, seconds=10.0)
    process(local, folder / "labels", SETTINGS)
    return Survey(s3, s3.upload(local, "dask/walks"), bytes_of(folder / "labels"))


@pytest.fixture(scope="module")
def cluster(s3: Bucket) -> Iterator[DaskProcesses]:
    with dask_processes(workers=2) as made:
        yield made


class Told:
    """What a run reports; something happens when the first session is done."""

    def __init__(self, then: Callable[[], None] = lambda: None) -> None:
        self.repeated: list[bool] = []
        self.lines: list[str] = []
        self.then = then

    def __call__(self, outcome: Outcome, total: int) -> None:
        self.repeated.append(outcome.repeated)
        if len(self.repeated) == 1:
            self.then()


def processed(survey: Survey, name: str, cluster: DaskProcesses, told: Told) -> None:
    with connected(cluster.address, None, told.lines.append) as client:
        executor = DaskExecutor(client, told.lines.append)
        process(survey.stored, Path(survey.s3.store(name).address), SETTINGS, executor=executor, progress=told)


def begun(survey: Survey, name: str, cluster: DaskProcesses) -> subprocess.Popen[bytes]:
    """The command as a process of its own."""
    folders = [survey.stored.as_posix().replace(":/", "://"), "--out", survey.s3.store(name).address]
    options = ["--strategy", "local-corrected", "--executor", "dask", "--scheduler", cluster.address]
    return subprocess.Popen([sys.executable, "-m", "vislam2tag", "process", *folders, *options], cwd=ROOT)


@pytest.mark.campaign
@pytest.mark.parametrize("written", range(2, 22))
@pytest.mark.parametrize("victim", ["worker", "scheduler", "client"])
def test_killed_when_so_many_files_are_written(
    survey: Survey, tmp_path: Path, record_property: Callable[[str, object], None], victim: str, written: int
) -> None:
    name = f"killed-{victim}-{written}"
    store = survey.s3.store(name)
    with dask_processes(workers=2) as own:
        with begun(survey, name, own) as client:
            while client.poll() is None and sum(1 for _ in store.list()) < written:
                time.sleep(0.01)
            {"worker": own.kill_worker, "scheduler": own.kill_scheduler, "client": client.kill}[victim]()
        if victim == "scheduler":
            own.start_scheduler()
            own.add_worker()
        told = Told()
        processed(survey, name, own, told)
    record_property("repeated", told.repeated.count(True))
    assert bytes_of(survey.s3.download(name, tmp_path)) == survey.labels


def test_the_scheduler_gets_several_sessions_a_message(cluster: DaskProcesses, monkeypatch: pytest.MonkeyPatch) -> None:
    ended: list[str] = []
    messages: list[int] = []
    with connected(cluster.address, None, lambda _: None) as client:
        client.wait_for_workers(2)
        send = client.map

        def counted(function: object, jobs: list[Nothing], **options: object) -> object:
            messages.append(len(jobs))
            return send(function, jobs, **options)

        monkeypatch.setattr(client, "map", counted)
        executor = DaskExecutor(client, print)
        jobs = [Nothing(f"nothing-{number}") for number in range(100)]
        executor(do_nothing, iter(jobs), report=ended.append)
    assert sorted(ended) == sorted(job.slug for job in jobs)
    assert sum(messages) == 100
    assert len(messages) <= 100 / 4


def test_a_scheduler_that_is_lost_while_results_are_fetched_is_told(
    cluster: DaskProcesses, monkeypatch: pytest.MonkeyPatch
) -> None:
    with connected(cluster.address, None, lambda _: None) as client:
        client.wait_for_workers(2)

        def gone(futures: object) -> None:
            raise OSError("comm closed")

        monkeypatch.setattr(client, "gather", gone)
        executor = DaskExecutor(client, print)
        with pytest.raises(OutputError, match=rf"the scheduler at {cluster.address} is lost"):
            executor(do_nothing, iter([Nothing("nothing")]), report=lambda _: None)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries decide for themselves")
def test_a_worker_keeps_the_memory_of_a_session_for_the_next(cluster: DaskProcesses) -> None:
    pages: list[str] = []
    with connected(cluster.address, None, lambda _: None) as client:
        client.wait_for_workers(1)
        executor = DaskExecutor(client, print)
        executor(pages_asked_for, iter([Nothing("memory")]), report=pages.append)
    assert int(pages[0]) < 12_500, "20 MB are 5,000 pages: the system gave them once, not twenty times more"


def test_a_worker_killed_meanwhile_changes_nothing(survey: Survey, cluster: DaskProcesses, tmp_path: Path) -> None:
    told = Told(cluster.kill_worker)
    processed(survey, "worker-killed", cluster, told)
    assert len(told.repeated) == 4
    assert bytes_of(survey.s3.download("worker-killed", tmp_path)) == survey.labels
    assert any(line.startswith("dashboard: http") for line in told.lines)
    again = Told()
    processed(survey, "worker-killed", cluster, again)
    assert again.repeated == [False] * 4


def test_a_client_killed_meanwhile_loses_nothing(survey: Survey, cluster: DaskProcesses, tmp_path: Path) -> None:
    store = survey.s3.store("client-killed")
    with begun(survey, "client-killed", cluster) as client:
        while client.poll() is None and not list(store.list("sessions")):
            time.sleep(0.05)
        client.kill()
    told = Told()
    processed(survey, "client-killed", cluster, told)
    assert False in told.repeated
    assert bytes_of(survey.s3.download("client-killed", tmp_path)) == survey.labels


def test_a_worker_of_other_code_is_refused_by_name(survey: Survey, cluster: DaskProcesses, tmp_path: Path) -> None:
    told = Told()
    with dask_processes(workers=0) as mixed:
        mixed.add_worker(**{OTHER_CODE: "1"})
        with connected(mixed.address, None, told.lines.append) as client:
            client.wait_for_workers(1)
            executor = DaskExecutor(client, told.lines.append)

            def run_all(work: Any, todo: Iterable[Any], *, report: Report[Any, Any]) -> None:
                executor(work, map(OfThisWorker.of, todo), report=report)

            out = Path(survey.s3.store("mixed").address)
            run = partial(process, survey.stored, out, SETTINGS, executor=run_all, progress=told)
            with pytest.raises(OutputError, match=r"no worker has the same vislam2tag.*install the same"):
                run()
            mixed.add_worker()
            client.wait_for_workers(2)
            run()
    assert len([line for line in told.lines if "is not used, because its vislam2tag or libraries" in line]) == 2
    assert bytes_of(survey.s3.download("mixed", tmp_path)) == survey.labels


def test_a_session_that_kills_three_workers_fails_and_the_rest_goes_on(
    survey: Survey, cluster: DaskProcesses, tmp_path: Path
) -> None:
    local = survey.s3.download("dask/walks", tmp_path / "walks")
    (local / "floor_0" / "LG").rename(local / "floor_0" / "Deadly")
    told = Told()
    with connected(cluster.address, None, told.lines.append) as client:
        executor = DaskExecutor(client, told.lines.append)

        def run_all(work: object, todo: Iterable[Any], *, report: Report[Any, Any]) -> None:
            executor(run_or_die, todo, report=report)

        process(local, tmp_path / "labels", SETTINGS, executor=run_all, progress=told)
    results = [
        SessionResult.model_validate_json(path.read_bytes()) for path in sorted(tmp_path.glob("labels/sessions/*"))
    ]
    died = {result.device: result.error for result in results if "workers died" in (result.error or "")}
    assert died.keys() == {"Deadly"}
    assert "3 workers died while processing it (out of memory, or a library crashed), the last one " in str(
        died["Deadly"]
    )
    assert len(results) == 4


@pytest.mark.slow
def test_a_scheduler_that_is_lost_loses_nothing(survey: Survey, tmp_path: Path) -> None:
    with dask_processes(workers=1) as other:
        with pytest.raises(OutputError, match=rf"the scheduler at {other.address} is lost; run the same command again"):
            processed(survey, "scheduler-lost", other, Told(other.kill_scheduler))
        other.start_scheduler()
        other.add_worker()  # those of a lost scheduler end, too
        told = Told()
        processed(survey, "scheduler-lost", other, told)
    assert False in told.repeated
    assert bytes_of(survey.s3.download("scheduler-lost", tmp_path)) == survey.labels
