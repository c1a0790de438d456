"""The studio's data: the current survey, corrections and labels, also if other programs change them."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from vislam2tag.common.errors import DatasetError, SurveyError, UsageError
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.findings import Finding
from vislam2tag.common.folder_kinds import PROCESS, is_survey, written_by
from vislam2tag.datasets.labelled import labels_in, labels_instead
from vislam2tag.labeling.results import SessionResult
from vislam2tag.pipeline.labels.session import SessionJob, jobs_of, still_holds
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.pipeline.run.selection import Selection, selected, session_task
from vislam2tag.quality.diagnosis.record import Diagnosis
from vislam2tag.sessions.registry import SurveyFiles, survey_files
from vislam2tag.settings import Settings
from vislam2tag.site.corrections.edits import corrections_of, corrections_text
from vislam2tag.site.corrections.file import CORRECTIONS_FILE, Corrections
from vislam2tag.site.discover import session_folders, site_files
from vislam2tag.site.landmark_file import landmarks_from
from vislam2tag.site.links import (
    CURE,
    is_from_outside,
    left_out_of,
    left_out_sessions,
    outside_link,
    shared_site,
)
from vislam2tag.site.model import Floor, SessionKey, SessionRef, Site, Survey, session_slugs
from vislam2tag.studio.messages import Versions
from vislam2tag.studio.outputs import BEFORE, LABELS, Output, Track


@dataclass(frozen=True)
class Snapshot:
    """A survey with corrections; ``problem`` says why the last usable file is used instead of the current one."""

    files: SurveyFiles
    corrections: Corrections
    survey: Survey
    version: str
    problem: str | None

    @cached_property
    def ids(self) -> tuple[str, ...]:
        """Ids of the sessions in the order of their folders, independent of corrections."""
        return session_slugs([found.key for found in self.files.sessions])

    @cached_property
    def refs(self) -> Mapping[str, SessionRef]:
        """Sessions by id."""
        by_folder = {ref.folder: ref for ref in self.survey.sessions}
        return {id: by_folder[found.folder] for id, found in zip(self.ids, self.files.sessions, strict=True)}

    @cached_property
    def folder_keys(self) -> Mapping[str, SessionKey]:
        """Keys by the names of folders, by id."""
        return dict(zip(self.ids, (found.key for found in self.files.sessions), strict=True))

    @cached_property
    def id_of_key(self) -> Mapping[str, str]:
        """Ids by the text of the corrected key."""
        return {str(ref.key): id for id, ref in self.refs.items()}

    def slugs(self, id: str) -> tuple[str, ...]:
        """Possible names of the session's labels: the current one, and that without corrections."""
        return tuple(dict.fromkeys((self.refs[id].slug, id)))


def _mapped_together(labels: Output) -> tuple[Finding, ...]:
    """Labels that the studio cannot make itself."""
    if not labels.settings().get("together"):
        return ()
    message = (
        "these labels were mapped with --together. The studio maps each walk alone, which may lose positions; after "
        "corrections, run: vislam2tag process SURVEY --out LABELS --together"
    )
    return (Finding(kind="mapped_together", file="", count=1, message=message),)


def _refuse_others(out: Path, compared: Sequence[Path]) -> None:
    """Raise DatasetError if the folder for labels is something else, or a folder to compare with has no labels."""
    others = [out] if written_by(out) not in (None, PROCESS) or is_survey(out) else []
    others += [folder for folder in compared if written_by(folder) != PROCESS]
    if others:
        raise DatasetError(f"{others[0]}: not an output folder of `{PROCESS}`; {labels_instead(others[0])}")


class Workspace:
    """The current survey and labels; used by several threads."""

    def __init__(self, root: Path, out: Path, settings: Settings, compared: Sequence[Path] = ()) -> None:
        """Read the survey; raises SurveyError if it is none or its corrections are wrong, and UsageError for the
        setting ``together``, because the studio processes each walk separately.
        """
        if settings.together:
            raise UsageError("together: the studio processes each walk separately; remove this entry from the settings")
        out, compared = labels_in(out), [labels_in(folder) for folder in compared]
        _refuse_others(out, compared)
        self.root, self.out, self.settings = root, out, settings
        self._scratch = ExitStack()
        before = self._scratch.enter_context(scratch_folder())
        self.outputs = {LABELS: Output(LABELS, out), BEFORE: Output(BEFORE, before.path)}
        for number, folder in enumerate(compared, start=1):
            self.outputs[f"compare-{number}"] = Output(f"compare-{number}", folder)
        self.before_slugs: dict[str, str] = {}
        """Names that sessions with changed labels have in the output ``before``, by id."""
        self.diagnosis: tuple[Diagnosis, str] | None = None
        """The last complete one, and the version of what it searched."""
        self._lock = threading.RLock()
        self._stale: tuple[str, frozenset[str]] | None = None
        self._shares = False
        self.left_out: tuple[Finding, ...] = ()
        """Names of files that :meth:`leave_out_links` skipped."""
        self.of_labels = _mapped_together(self.outputs[LABELS])
        """Findings about the labels as they were when the studio started."""
        self._site_stamp = self._look_at_site()
        self._content, self._content_version = corrections_text(root)
        self.now = self._snapshot(self._files(), self._content)

    def close(self) -> None:
        """Remove the earlier labels."""
        self._scratch.close()

    def leave_out_links(self) -> None:
        """From now on, skip files that links lead to outside the survey: site files, and sessions with such files.

        Raises SurveyError if no session remains, or corrections or labels come from outside.
        """
        if (link := outside_link(self.root, self.root / CORRECTIONS_FILE)) is not None:
            raise SurveyError(f"{self.root / link}: a link leads to it outside the survey; {CURE}")
        for output in self.outputs.values():
            if is_from_outside(output.root, [output.root]):
                raise SurveyError(f"{output.root}: the folder has links to files outside it; {CURE}")
        with self._lock:
            self._shares = True
            self.now = self._snapshot(self._files(), self._content)

    def refresh(self) -> Versions:
        """Check whether anything changed; returns the current versions."""
        with self._lock:
            stamp = self._look_at_site()
            try:
                text, version = corrections_text(self.root)
                files = self.now.files
                if stamp != self._site_stamp:
                    files = self._files()
                if stamp != self._site_stamp or version != self._content_version:
                    self._site_stamp, self._content_version = stamp, version
                    self.now = self._snapshot(files, text)
            except SurveyError as error:
                self._site_stamp, self._content_version = stamp, ""
                self.now = Snapshot(self.now.files, self.now.corrections, self.now.survey, "", str(error))
            return self._versions()

    def searched(self) -> str:
        """Version of everything that decides which faults there are: not which of them are ignored."""
        labels = self.refresh().labels
        corrections = self.now.corrections.model_copy(update={"ignore_fault": ()})
        return hashlib.sha256(f"{self._site_stamp}{corrections.model_dump_json()}{labels}".encode()).hexdigest()

    def _files(self) -> SurveyFiles:
        """The contents of the folder; an empty folder is a survey to prepare."""
        if is_empty(self.root):
            return SurveyFiles(self.root, Site((), landmarks_from([])), (), (), ())
        files = survey_files(self.root, self.settings.survey.landmark_sigma_m, walked=False)
        return self._shared(files) if self._shares else files

    def _shared(self, files: SurveyFiles) -> SurveyFiles:
        """The part of a survey that may be shared; records what is skipped."""
        site, findings = shared_site(self.root, files.site, files.findings)
        _, odd_folders = shared_site(self.root, files.site, files.odd_folders)
        kept = tuple(found for found in files.sessions if not found.from_outside)
        ids = session_slugs([found.key for found in files.sessions])
        gone = [id for id, found in zip(ids, files.sessions, strict=True) if found.from_outside]
        if gone and not kept:
            raise SurveyError(f"{self.root}: links lead to the files of all sessions outside the survey; {CURE}")
        if session_slugs([found.key for found in kept]) != tuple(id for id in ids if id not in gone):
            raise SurveyError(
                f"{self.root}: two sessions have the same name, and one of them is a link; rename it, or {CURE}"
            )
        named = [left_out_sessions(gone, named=True)] if gone else []
        counted = [left_out_sessions(gone, named=False)] if gone else []
        self.left_out = (*named, *left_out_of(findings))
        return SurveyFiles(
            files.root,
            site,
            kept,
            (*findings, *counted),
            tuple(finding for finding in odd_folders if finding.kind != "from_outside"),
        )

    def corrected(self, files: SurveyFiles, corrections: Corrections) -> Survey:
        """The corrected survey with the studio's settings; raises SurveyError if corrections are wrong."""
        return files.corrected(corrections, use_planned=self.settings.survey.use_planned)

    def _snapshot(self, files: SurveyFiles, text: str) -> Snapshot:
        corrections = corrections_of(text)
        version = hashlib.sha256(f"{self._site_stamp}{text}".encode()).hexdigest()[:16]
        return Snapshot(
            files,
            corrections,
            self.corrected(files, corrections),
            version,
            None,
        )

    def _versions(self) -> Versions:
        labels = self.outputs[LABELS].stamp()
        survey = self.now.version
        return Versions(survey=survey, sessions=f"{survey}-{labels}", corrections=self._content_version, labels=labels)

    def _look_at_site(self) -> str:
        files = [path for path in site_files(self.root) if path.name != CORRECTIONS_FILE]
        stats = [(str(path), stat.st_mtime_ns, stat.st_size) for path in files for stat in [path.stat()]]
        folders = [] if is_empty(self.root) else [str(folder) for _, folder in session_folders(self.root)[0]]
        return hashlib.sha256(repr((stats, folders)).encode()).hexdigest()

    def result(self, id: str, output: str = LABELS) -> SessionResult | None:
        """Result of a session in an output: the earlier one if requested and kept, otherwise the current one."""
        if output == BEFORE and id in self.before_slugs:
            return self.outputs[BEFORE].result([self.before_slugs[id]])
        found = self.outputs[LABELS if output == BEFORE else output].result(self.now.slugs(id))
        return None if self._shares and found is not None and found.from_outside else found

    def output_of(self, id: str, output: str) -> Output:
        """The folder that a session's labels of an output are in."""
        kept = output == BEFORE and id in self.before_slugs
        return self.outputs[LABELS if output == BEFORE and not kept else output]

    def track(self, id: str, output: str = LABELS) -> Track | None:
        """Frames of a session in an output; None if it has none."""
        result = self.result(id, output)
        return None if result is None else self.output_of(id, output).track(result)

    def start_ns(self, id: str) -> int:
        """Time of a walk's first frame, the origin of times in corrections; 0 if it has no frames."""
        track = self.track(id)
        return track.start_ns if track else 0

    def stale(self) -> frozenset[str]:
        """Ids of the sessions with outdated labels."""
        version = self.refresh().sessions
        if self._stale is None or self._stale[0] != version:
            self._stale = version, frozenset(self.touched(self.now.survey, self.now.corrections))
        return self._stale[1]

    def jobs(self, survey: Survey, corrections: Corrections) -> dict[str, SessionJob]:
        """Jobs that label the sessions of a survey with corrections, by id; excluded sessions have none."""
        refs = selected(survey, corrections, Selection())
        ids = {found.folder: id for id, found in zip(self.now.ids, self.now.files.sessions, strict=True)}
        tasks = [session_task(ref, survey, corrections, self.settings) for ref in refs]
        made = jobs_of(tasks, self.settings, OutputFolder(self.out))
        return {ids[job.task.ref.folder]: job for job in made}

    def touched(self, survey: Survey, corrections: Corrections) -> list[str]:
        """Ids of the sessions with labels that are outdated for a survey with corrections, missing or superfluous.

        Sessions that could not be mapped are not among them.
        """
        jobs = self.jobs(survey, corrections)
        return [id for id in self.now.ids if self._is_touched(jobs.get(id), id)]

    def _is_touched(self, job: SessionJob | None, id: str) -> bool:
        if job is None:
            return self.outputs[LABELS].result(self.now.slugs(id)) is not None
        done = self.outputs[LABELS].result([job.slug])
        if done is None:
            return True
        unchanged = {file.name: file.sha256 for file in done.files}  # raw files are not read
        return done.error is None and not still_holds(job, done, unchanged)


def beside(root: Path, what: str) -> Path:
    """The folder of a product of a survey: ``SURVEY-what`` next to it."""
    return root.resolve().with_name(f"{root.resolve().name}-{what}")


def is_empty(root: Path) -> bool:
    """Whether a folder exists and contains only hidden files."""
    return root.is_dir() and all(path.name.startswith(".") for path in root.iterdir())


def plan_stamp(floor: Floor) -> str:
    """Version of a floor's plan and the corrections of its walkable space."""
    files = [path for path in (floor.plan, floor.mask) if path is not None and path.exists()]
    return "-".join(str(path.stat().st_mtime_ns) for path in files)
