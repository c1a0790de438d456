"""A survey that is opened for a command: settings, chosen sessions, executor, and refused outputs."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Self, TypedDict, TypeVar, cast

from vislam2tag.common.errors import OutputError, UsageError
from vislam2tag.common.files.given_files import AnyPath, path_or_none
from vislam2tag.estimation.strategy import refuse_elsewhere
from vislam2tag.labeling.settings import GivenSettings, ProcessSettings
from vislam2tag.pipeline.run.workers import Executor, process_all
from vislam2tag.sessions.prepared import SessionTask
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.corrections.file import Corrections, read_corrections
from vislam2tag.site.model import SessionRef, Survey

_Value = TypeVar("_Value", int, str)
_HERE = partial(process_all, workers=1)


@dataclass(frozen=True)
class Selection:
    """The sessions of a survey that a command processes; an empty tuple means all."""

    floors: tuple[int, ...] = ()
    devices: tuple[str, ...] = ()

    @property
    def everything(self) -> bool:
        """Whether it includes everything."""
        return not self.floors and not self.devices

    def contains(self, ref: SessionRef) -> bool:
        """Whether a session is selected."""
        return (not self.floors or ref.key.floor in self.floors) and (
            not self.devices or ref.key.device in self.devices
        )


class RunChoices(TypedDict, total=False):
    """Options of all commands that process sessions of a survey.

    ``landmarks`` is a file with the landmarks of all floors that replaces the floors' own. With ``jobs`` > 1 sessions
    run in that many processes (call it from under ``if __name__ == "__main__":``).
    """

    landmarks: AnyPath | None
    selection: Selection | None
    jobs: int


class ProcessChoices(RunChoices, total=False):
    """Options of ``process``: those of any run, and an ``executor`` that runs sessions elsewhere."""

    executor: Executor | None


class ProcessArguments(ProcessChoices, GivenSettings, total=False):
    """Keyword arguments of ``process``: its choices, and settings by name."""


class SurveyRunArguments(GivenSettings, total=False):
    """Keyword arguments of ``run``: ``landmarks`` and ``jobs`` as in :class:`RunChoices`, and settings by name."""

    landmarks: AnyPath | None
    jobs: int


def choices_of(arguments: ProcessArguments) -> ProcessChoices:
    """The arguments that are not settings."""
    chosen = {name: value for name, value in arguments.items() if name in ProcessChoices.__annotations__}
    return cast(ProcessChoices, chosen)


def given_settings(arguments: ProcessArguments | SurveyRunArguments) -> GivenSettings:
    """The other arguments, which are checked as settings."""
    others = {name: value for name, value in arguments.items() if name not in ProcessChoices.__annotations__}
    return cast(GivenSettings, others)


@dataclass(frozen=True)
class OpenedSurvey:
    """An open survey with its corrections, settings and selection."""

    survey: Survey
    corrections: Corrections
    settings: ProcessSettings
    selection: Selection = Selection()
    landmark_file: Path | None = None
    """Landmark file that replaces those of the floors."""
    run_all: Executor = _HERE

    @classmethod
    def at(
        cls,
        root: AnyPath,
        settings: ProcessSettings | None = None,
        *,
        landmarks: AnyPath | None = None,
        selection: Selection | None = None,
        jobs: int = 1,
        executor: Executor | None = None,
    ) -> Self:
        """Open a survey for a command; raises SurveyError as :func:`~vislam2tag.sessions.registry.open_survey`.

        Raises UsageError for a strategy of a notebook if sessions run in other processes.
        """
        settings = settings or ProcessSettings()
        if jobs > 1 or executor is not None:
            refuse_elsewhere(settings.strategy)
        survey = open_survey(root, settings.survey.landmark_sigma_m, landmarks, use_planned=settings.survey.use_planned)
        run_all = executor or partial(process_all, workers=jobs)
        corrections = read_corrections(survey.root)
        return cls(survey, corrections, settings, selection or Selection(), path_or_none(landmarks), run_all)

    @property
    def refs(self) -> list[SessionRef]:
        """The chosen sessions; raises UsageError as :func:`selected`."""
        return selected(self.survey, self.corrections, self.selection)

    @property
    def others(self) -> list[SessionRef]:
        """The sessions outside the selection, without those that corrections exclude."""
        every = selected(self.survey, self.corrections, Selection())
        return [ref for ref in every if not self.selection.contains(ref)]

    def tasks(self, refs: Iterable[SessionRef]) -> list[SessionTask]:
        """How sessions are to be read."""
        return [session_task(ref, self.survey, self.corrections, self.settings) for ref in refs]

    def refuse_output(self, out: Path, before: Iterable[str]) -> None:
        """Raise OutputError for an output among the raw data, or if ``out`` has sessions outside the selection.

        ``before`` are the slugs of the sessions in that record, which this run would replace.
        """
        refuse_among_sessions(self.survey, out)
        left_out = [] if self.selection.everything else sorted(set(before) - {ref.slug for ref in self.refs})
        if left_out:
            more = f" and {len(left_out) - 1} more" if len(left_out) > 1 else ""
            raise OutputError(
                f"{out}: this run would remove the results of {left_out[0]}{more}, which --floor or --device exclude; "
                "run without --floor and --device, or choose another --out"
            )


def selected(survey: Survey, corrections: Corrections, selection: Selection) -> list[SessionRef]:
    """Return the chosen sessions, without those that corrections exclude.

    Raises UsageError for a floor or device without sessions.
    """
    _refuse_unknown("--floor", selection.floors, {ref.key.floor for ref in survey.sessions})
    _refuse_unknown("--device", selection.devices, {ref.key.device for ref in survey.sessions})
    return [ref for ref in survey.sessions if selection.contains(ref) and not corrections.excludes(ref.key)]


def _refuse_unknown(option: str, wanted: Sequence[_Value], there: Collection[_Value]) -> None:
    for value in wanted:
        if value not in there:
            names = ", ".join(map(str, sorted(there)))
            raise UsageError(f"{option} {value}: the survey has no session with this {option[2:]}; it has: {names}")


def session_task(ref: SessionRef, survey: Survey, corrections: Corrections, settings: ProcessSettings) -> SessionTask:
    """How to read a session of a survey."""
    return SessionTask(ref, survey.site, corrections, settings.survey.landmark_sigma_m, settings.findings)


def refuse_among_sessions(survey: Survey, out: Path) -> None:
    """Raise OutputError for an output folder among the raw data, because the next run would take it for a device."""
    inside = survey.root.resolve() in out.resolve().parents
    if inside and out.resolve().relative_to(survey.root.resolve()).parts[0].startswith("floor_"):
        raise OutputError(
            f"{out}: this folder is among the survey's sessions, which must not change; choose another --out"
        )
