"""What a run says of results in its output that it does not make itself: removed, or kept and out of date."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from vislam2tag.common.findings import Finding
from vislam2tag.labeling.results import RESULTS, SessionResult
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.session import Job, code_of, still_holds
from vislam2tag.pipeline.labels.stored_session import Output
from vislam2tag.pipeline.run.store import OutputFolder
from vislam2tag.sessions.prepared import SessionTask


def removed_findings(slugs: Iterable[str]) -> list[Finding]:
    """Name the sessions whose results were removed."""
    return [
        Finding(
            kind="removed_labels",
            file=f"{RESULTS}/{slug}.json",
            count=1,
            message=f"the results of {slug} were removed from the output: the survey no longer contains this session, "
            "or corrections exclude it",
        )
        for slug in slugs
    ]


def outdated_findings(folder: Output, left_out: Sequence[SessionTask], settings: ProcessSettings) -> list[Finding]:
    """Name the sessions that a selection leaves out and whose results a run without it would make again.

    The sessions' own files are not read for that. Of those in a store or a zip only a change of the source is found.
    """
    if not left_out:
        return []
    code = {name: code_of(name, settings) for name in sorted({task.ref.format for task in left_out})}
    jobs = {task.ref.slug: Job(task, settings, OutputFolder(Path()), code[task.ref.format]) for task in left_out}
    return list(_outdated(jobs, folder.results(jobs)))


def _outdated(jobs: dict[str, Job], results: Iterable[SessionResult]) -> Iterator[Finding]:
    for result in results:
        if result.fingerprint and not _is_current(jobs[result.slug], result):
            yield Finding(
                kind="outdated_labels",
                file=f"{RESULTS}/{result.slug}.json",
                count=1,
                message=f"the labels of {result.slug} are out of date and this run leaves them as they are; run "
                "without --floor and --device to make them again",
            )


def _is_current(job: Job, result: SessionResult) -> bool:
    ref = job.task.ref
    if ref.stored is not None or ref.packed is not None:
        return result.parts.get("code") == job.code
    return still_holds(job, result, {file.name: file.sha256 for file in result.files})
