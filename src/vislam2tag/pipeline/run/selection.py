"""Which sessions of a survey a command is for, and where it must not write."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import OutputError, UsageError
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.sessions.prepared import SessionTask
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.model import SessionRef, Survey


@dataclass(frozen=True)
class Selection:
    """Which sessions of a survey that a command is for; an empty tuple means all."""

    floors: tuple[int, ...] = ()
    devices: tuple[str, ...] = ()

    @property
    def everything(self) -> bool:
        """Whether it leaves nothing out."""
        return not self.floors and not self.devices

    def contains(self, ref: SessionRef) -> bool:
        """Whether a session is selected."""
        return (not self.floors or ref.key.floor in self.floors) and (
            not self.devices or ref.key.device in self.devices
        )


def selected(survey: Survey, corrections: Corrections, selection: Selection) -> list[SessionRef]:
    """Return the chosen sessions, without those that corrections exclude.

    Raises UsageError for a floor or device of which the survey has no session.
    """
    for wanted, have, option in (
        (selection.floors, {ref.key.floor for ref in survey.sessions}, "--floor"),
        (selection.devices, {ref.key.device for ref in survey.sessions}, "--device"),
    ):
        unknown = [value for value in wanted if value not in have]
        if unknown:
            there = ", ".join(str(value) for value in sorted(have, key=str))
            raise UsageError(f"{option} {unknown[0]}: the survey has no session of it; there are: {there}")
    return [ref for ref in survey.sessions if selection.contains(ref) and not corrections.excludes(ref.key)]


def refuse_left_out(out: Path, before: Iterable[str], refs: Iterable[SessionRef], selection: Selection) -> None:
    """Raise OutputError if a selection would replace, in ``out``, a whole record of sessions that it leaves out.

    ``before`` are the slugs of the sessions that ``out`` is about, ``refs`` those of the present run.
    """
    left_out = [] if selection.everything else sorted(set(before) - {ref.slug for ref in refs})
    if left_out:
        more = f" and {len(left_out) - 1} more" if len(left_out) > 1 else ""
        raise OutputError(
            f"{out}: contains results of {left_out[0]}{more}, which --floor or --device leave out and this run would "
            "remove; run without --floor and --device, or choose another --out"
        )


def session_task(ref: SessionRef, survey: Survey, corrections: Corrections, settings: ProcessSettings) -> SessionTask:
    """Say how a session of a survey is to be read."""
    return SessionTask(ref, survey.site, corrections, settings.survey.landmark_sigma_m, settings.findings)


def refuse_among_sessions(survey: Survey, out: Path) -> None:
    """Raise OutputError for an output folder among the raw data, where the next run would take it for a device's."""
    inside = survey.root.resolve() in out.resolve().parents
    if inside and out.resolve().relative_to(survey.root.resolve()).parts[0].startswith("floor_"):
        raise OutputError(f"{out}: lies among the survey's sessions, which stay as they are; choose another --out")
