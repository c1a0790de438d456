"""Work in other processes: jobs one after the other, and long computations while a survey is prepared.

Jobs process sessions again, search for faults, create radio maps, and write folders to share.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import ParamSpec, TypeVar

from vislam2tag.common.errors import OutputError, SurveyError, UsageError, Vislam2tagError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.records import FiniteRecord
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.labeling.results import RESULTS
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.labeling.tables import TRAJECTORY
from vislam2tag.pipeline.labels.diagnose import diagnose
from vislam2tag.pipeline.labels.label_run import label_run
from vislam2tag.pipeline.labels.session import jobs_of
from vislam2tag.pipeline.run.failures import unexpected
from vislam2tag.pipeline.run.selection import OpenedSurvey
from vislam2tag.pipeline.run.workers import done_in, run_job, worker_pool
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.model import Survey
from vislam2tag.studio.export import make_dataset, make_page
from vislam2tag.studio.messages import NewLabels
from vislam2tag.studio.outputs import BEFORE
from vislam2tag.studio.radio import Radio, made_radio, radio_job
from vislam2tag.studio.work_messages import Job, JobKind, JobRequest
from vislam2tag.studio.workspace import Workspace

KEPT = 50
"""Number of finished jobs that are still listed."""
MOST_WAITING = 20
LOOK_S = 0.2
"""Interval for checking whether a job was cancelled."""
IDLE_S = 3.0
"""Summary and report are written again after this idle time."""
_BEFORE_FILES = ((TRAJECTORY, "parquet"), ("wifi", "parquet"), (RESULTS, "json"))


class _CancelledError(Exception):
    """The job was cancelled while it ran."""


class JobQueue:
    """Runs jobs in its own thread; :meth:`close` ends it and its processes."""

    def __init__(self, workspace: Workspace, publish: Callable[[str, FiniteRecord], None], workers: int) -> None:
        """Start the workers, which import the mapping code meanwhile."""
        self._workspace, self._publish, self._workers = workspace, publish, workers
        self._jobs: dict[int, Job] = {}
        self._requests: dict[int, JobRequest] = {}
        self._waiting: deque[int] = deque()
        self._changed = threading.Condition()
        self._stopping = False
        self._unfinished = False
        """Whether summary and report are older than the labels."""
        self.radio: tuple[Radio, str] | None = None
        """The last radio maps, and the version of their labels."""
        self._work_of: dict[JobKind, Callable[[int, ProcessPoolExecutor], None]] = {
            "process": self._process,
            "diagnose": self._diagnose,
            "radio": self._radio,
            "dataset": self._dataset,
            "page": self._page,
        }
        self._thread = threading.Thread(target=self._run, name="studio jobs")
        self._thread.start()

    def submit(self, request: JobRequest) -> Job:
        """Queue a job; raises UsageError if too many wait or it names an unknown session."""
        unknown = set(request.sessions or ()) - self._workspace.now.refs.keys()
        if unknown:
            raise UsageError(f"session {min(unknown)} does not exist; check the list")
        with self._changed:
            if len(self._waiting) >= MOST_WAITING:
                raise UsageError(f"{MOST_WAITING} jobs are already waiting; wait until some have ended")
            number = max(self._jobs, default=0) + 1
            job = Job(
                id=number, kind=request.kind, state="queued", done=0, total=0, error=None, failed={}, seconds=None
            )
            self._jobs[number], self._requests[number] = job, request
            self._waiting.append(number)
            for old in list(self._jobs)[:-KEPT]:
                del self._jobs[old]
            self._changed.notify()
        self._publish("job", job)
        return job

    def all(self) -> list[Job]:
        """The latest jobs, in their order."""
        with self._changed:
            return list(self._jobs.values())

    def cancel(self, number: int) -> Job:
        """Cancel a job: its finished work stays; raises KeyError if there is none."""
        with self._changed:
            job = self._jobs[number]
            if number in self._waiting:
                self._waiting.remove(number)
        return self._update(number, state="cancelled") if job.state in ("queued", "running") else job

    def close(self) -> None:
        """End all jobs; outdated summary and report are written first."""
        with self._changed:
            self._stopping = True
            self._waiting.clear()
            for number in [number for number, job in self._jobs.items() if job.state == "running"]:
                self._jobs[number] = self._jobs[number].model_copy(update={"state": "cancelled"})
            self._changed.notify()
        self._thread.join()

    def _update(self, number: int, **changes: object) -> Job:
        with self._changed:
            job = self._jobs[number] = self._jobs[number].model_copy(update=changes)
        self._publish("job", job)
        return job

    def _run(self) -> None:
        while not self._stopping or self._unfinished:
            with ExitStack() as stack:
                pool = stack.enter_context(worker_pool(self._workers))
                for _ in range(self._workers):
                    pool.submit(_made_ready, self._workspace.settings)
                with suppress(OutputError, BrokenProcessPool):  # a worker was killed, so new ones are started
                    self._work(pool)

    def _work(self, pool: ProcessPoolExecutor) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._stopping, IDLE_S if self._unfinished else None)
                number = self._waiting.popleft() if self._waiting else None
            if number is not None:
                self._do(number, pool)
            elif self._unfinished:
                self._finish(pool)
            if self._stopping and number is None:
                return

    def _do(self, number: int, pool: ProcessPoolExecutor) -> None:
        began = time.monotonic()
        job = self._update(number, state="running")
        try:
            self._work_of[job.kind](number, pool)
        except _CancelledError:
            return
        except Exception as error:  # on any error, the server continues and the page is notified
            said = str(error) if isinstance(error, Vislam2tagError) else unexpected(job.kind, error)
            self._update(number, state="failed", error=said, seconds=time.monotonic() - began)
            if isinstance(error, OutputError):
                raise
            return
        if not self._is_cancelled(number):
            self._update(number, state="done", seconds=time.monotonic() - began)

    def _is_cancelled(self, number: int) -> bool:
        return self._jobs[number].state == "cancelled"

    def _process(self, number: int, pool: ProcessPoolExecutor) -> None:
        workspace = self._workspace
        workspace.refresh()
        now = workspace.now
        if now.problem is not None:
            raise SurveyError(now.problem)
        requested = self._requests[number].sessions
        failed = [id for id in now.ids if (result := workspace.result(id)) is not None and result.error is not None]
        wanted = list(requested) if requested is not None else sorted({*workspace.stale(), *failed})
        self._keep_before(wanted)
        id_of = {ref.folder: id for id, ref in now.refs.items()}
        with label_run(OpenedSurvey(now.survey, now.corrections, workspace.settings), workspace.out) as run:
            self._unfinished = True
            tasks = [task for task in run.tasks if id_of[task.ref.folder] in wanted]
            todo = {job.slug: job for job in jobs_of(tasks, run.settings, run.folder)}
            left_out = sorted(set(wanted) - {id_of[job.task.ref.folder] for job in todo.values()})
            self._tell_labels(left_out)
            failures: dict[str, str] = {}
            self._update(number, total=len(todo))
            stopped = lambda: self._is_cancelled(number)
            for count, outcome in enumerate(done_in(pool, run_job, list(todo.values()), stopped), start=1):
                id = id_of[todo[outcome.slug].task.ref.folder]
                if outcome.error is not None:
                    failures[id] = outcome.error
                self._tell_labels([id])
                self._update(number, done=count, failed=dict(failures))

    def _tell_labels(self, ids: Sequence[str]) -> None:
        if ids:
            self._publish("labels", NewLabels(sessions=list(ids), version=self._workspace.refresh().labels))

    def _keep_before(self, ids: Sequence[str]) -> None:
        """Keep the current labels of sessions: files are replaced atomically, so a hard link keeps the old version.

        Those that were kept before an earlier job go, because the others are now as they were before this one.
        """
        if not ids:
            return
        workspace = self._workspace
        before = Folder.at(workspace.outputs[BEFORE].root)
        old, workspace.before_slugs = workspace.before_slugs, {}  # requests read it meanwhile
        for slug in old.values():
            for table, suffix in _BEFORE_FILES:
                before.remove(f"{table}/{slug}.{suffix}")
        for id in ids:
            result = workspace.result(id)
            if result is None:
                continue
            for table, suffix in _BEFORE_FILES:
                file = f"{table}/{result.slug}.{suffix}"
                with suppress(FileNotFoundError):
                    before.link(workspace.out / file, file)
            workspace.before_slugs[id] = result.slug

    def _diagnose(self, number: int, pool: ProcessPoolExecutor) -> None:
        del pool  # diagnosis starts its own processes
        version, settings = self._workspace.searched(), self._workspace.settings
        found = diagnose(self._workspace.root, settings, jobs=self._workers, progress=self._counted(number))
        self._workspace.diagnosis = found, version

    def _radio(self, number: int, pool: ProcessPoolExecutor) -> None:
        version = self._workspace.refresh().labels
        made = pool.submit(made_radio, radio_job(self._workspace))
        while not made.done():
            if self._is_cancelled(number):
                made.cancel()
                raise _CancelledError
            wait([made], LOOK_S)
        self.radio = made.result(), version

    def _dataset(self, number: int, pool: ProcessPoolExecutor) -> None:
        del pool  # as above
        request = self._requests[number]
        make_dataset(
            self._workspace, request.no_ssid, request.hash_bssid, self._workers, progress=self._counted(number)
        )

    def _page(self, number: int, pool: ProcessPoolExecutor) -> None:
        del pool
        make_page(self._workspace, self._counted(number))

    def _counted(self, number: int) -> Callable[[object, int], None]:
        """Report each step of a job to the page, and stop if it was cancelled."""
        done = 0

        def progress(_step: object, total: int) -> None:
            nonlocal done
            if self._is_cancelled(number):
                raise _CancelledError
            done = done % total + 1  # a further stage starts at zero
            self._update(number, done=done, total=total)

        return progress

    def _finish(self, pool: ProcessPoolExecutor) -> None:
        """Write summary and report of the current labels."""
        self._unfinished = False
        now = self._workspace.now
        if now.problem is None:
            with suppress(Vislam2tagError):  # the next job or the command line writes them
                made = pool.submit(_reduced, now.survey, now.corrections, self._workspace.out, self._workspace.settings)
                made.result()


def _made_ready(settings: ProcessSettings) -> None:
    """Import the mapping code; runs in a worker."""
    strategy_named(settings.strategy, settings.mapping)


def _reduced(survey: Survey, corrections: Corrections, out: Path, settings: ProcessSettings) -> None:
    """Write summary and report; runs in a worker."""
    with label_run(OpenedSurvey(survey, corrections, settings), out) as run:
        run.reduced()


_Asked = ParamSpec("_Asked")
_Answer = TypeVar("_Answer")


class Worker:
    """One process with a cache of its plans, started with the first work. Used by many threads."""

    def __init__(self) -> None:
        """Start nothing yet."""
        self._running = ExitStack()
        self._pool: ProcessPoolExecutor | None = None
        self._start, self._turn = threading.Lock(), threading.Lock()
        self._latest = 0

    def close(self) -> None:
        """End the process."""
        with self._start:
            self._pool = None
            self._running.close()

    def do(self, work: Callable[_Asked, _Answer], *args: _Asked.args, **values: _Asked.kwargs) -> _Answer:
        """Call a module's function there; raises its errors, and OutputError if the process was killed."""
        with self._start:
            if self._pool is None:
                self._pool = self._running.enter_context(worker_pool(1))
            asked = self._pool.submit(work, *args, **values)
        try:
            return asked.result()
        except BrokenProcessPool:
            self.close()
            raise OutputError("the planning process was killed; try again") from None

    def do_latest(self, work: Callable[_Asked, _Answer], *args: _Asked.args, **values: _Asked.kwargs) -> _Answer:
        """As :meth:`call`, but only for the last of several waiting callers; raises OutputError for the rest."""
        self._latest += 1
        mine = self._latest
        with self._turn:
            if mine != self._latest:
                raise OutputError("a later change of the plan has replaced this one")
            return self.do(work, *args, **values)
