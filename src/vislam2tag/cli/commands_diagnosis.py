"""Commands that find mistakes of landmarks, or their positions: ``diagnose`` and ``survey-landmarks``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    ConfigFile,
    FollowLinks,
    Jobs,
    SurveyFolder,
    setting,
    settings_from,
    settings_of,
)
from vislam2tag.cli.progress import outputs_of_interrupted, session_bar
from vislam2tag.cli.records import command, option
from vislam2tag.cli.tables import print_warnings, show_table
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Answer

if TYPE_CHECKING:
    from rich.table import Table

    from vislam2tag.pipeline.labels.landmark_results import LandmarkRow, LandmarkSurvey
    from vislam2tag.quality.diagnosis.record import Fault, Gain


@dataclass(frozen=True, kw_only=True)
class DiagnoseOptions:
    """Arguments and options of ``vislam2tag diagnose``."""

    survey: SurveyFolder
    apply: bool = option(False, "Add the corrections to the survey's corrections.toml.")
    revert: bool = option(False, "Remove what --apply added, and end.")
    conflicts: Path | None = option(None, "Write a page with a map of agreements and contradictions.", metavar="FILE")
    follow_links: FollowLinks = False
    json: AsJson = False
    jobs: Jobs = ALL_CORES
    config: ConfigFile = None
    use_planned: bool | None = setting("survey.use_planned")


@command
def diagnose_command(given: DiagnoseOptions) -> None:
    """Find the mistakes of a survey, with their evidence and the lines for corrections.toml.

    No ground truth is needed, because walks that pass the same landmarks show which of them contradict the table
    (docs/how-to/diagnosis.md). The command finds interchanged, mis-surveyed, moved and duplicate landmarks, and ids
    that do not match. It finds tables that are mirrored, turned or in wrong units, sessions in the folder of another
    floor or device, wrong clocks, and repeated Wi-Fi scans. It also finds single outliers: a position, an observation,
    or the length scale of a device that contradicts all others.

    Faults that an `ignore_fault` entry of corrections.toml names are listed as ignored, with its reason.

    If nothing is wrong, the output names what was checked. If no walk passes enough landmarks, it says that nothing
    could be judged.

    Exit code: 0 nothing is wrong, 1 a mistake was found, or a session cannot be read, 2 wrong usage or not a survey, 3
    nothing could be judged, or --revert found nothing to remove, 130 interrupted. With --apply and --revert: 0 if that
    was done. A survey whose walks need no landmarks, because their floors have plans, also ends with 0.

    \b
    Examples:
      vislam2tag diagnose survey
      vislam2tag diagnose survey --conflicts conflicts.html
      vislam2tag diagnose survey --apply
      vislam2tag diagnose survey --revert
    """
    from vislam2tag.pipeline.labels.landmark_results import check_targets
    from vislam2tag.site.corrections.edits import add_entries
    from vislam2tag.site.corrections.file import CORRECTIONS_FILE

    if given.apply and given.revert:
        raise UsageError("--apply and --revert: use only one of the two")
    if given.revert:
        _revert(given)
    check_targets(given.survey, *([] if given.conflicts is None else [given.conflicts]))
    settings = settings_from(given, given.survey)
    with outputs_of_interrupted(), session_bar("sessions") as bar:
        advance = lambda session, total: bar.advance(total, session.error)
        found = api.diagnose(given.survey, settings, jobs=given.jobs, progress=advance)
    if given.conflicts is not None:
        _write_conflicts(given.conflicts, given, settings, found)
    if not given.json:
        say(_text(found))
    lines = "\n\n".join(fault.lines for fault in found.open if fault.corrections)
    if given.apply and lines:
        add_entries(given.survey, lines)
        added = "corrections added; remove them with --revert"
        say(f"{given.survey / CORRECTIONS_FILE}: {added}", err=given.json)
    failed = not (_is_sound(found) or (given.apply and lines))
    show = lambda: next_step(_after(found, given.apply), survey=given.survey)
    nothing = failed and found.judgement.answer in (Answer.NOT_JUDGED, Answer.NOT_LOOKED_AT)
    answer(found, given.json, show, failed=failed, nothing=nothing)


def _revert(given: DiagnoseOptions) -> None:
    from vislam2tag.site.corrections.edits import remove_added
    from vislam2tag.site.corrections.file import CORRECTIONS_FILE

    removed, file = remove_added(given.survey), given.survey / CORRECTIONS_FILE

    def show() -> None:
        say(f"{file}: {'corrections removed' if removed else 'contains no corrections of --apply'}")
        next_step("diagnose", survey=given.survey)

    answer({"corrections": file, "removed": removed}, given.json, show, nothing=not removed)


def _is_sound(found: api.Diagnosis) -> bool:
    return (found.judgement.answer is Answer.NOTHING_WRONG or found.needs_landmarks) and not found.failed


def _after(found: api.Diagnosis, applied: bool) -> str:
    """Name of the next step."""
    if found.correctable:
        return "diagnose" if applied else "diagnose, faults"
    if found.open:
        return "diagnose, by hand"
    return "diagnose" if _is_sound(found) else "diagnose, not judged"


def _write_conflicts(page: Path, given: DiagnoseOptions, settings: api.Settings, found: api.Diagnosis) -> None:
    from vislam2tag.site.links import left_out_of, shared_survey
    from vislam2tag.views.conflict_page import write_conflict_page

    opened = api.open_survey(given.survey, settings.survey.landmark_sigma_m, use_planned=settings.survey.use_planned)
    shown = shared_survey(opened, follow_links=given.follow_links)
    print_warnings(left_out_of(shown.findings))
    write_conflict_page(page, shown, found.references)
    say(f"conflicts: {page}", err=True)


def _text(found: api.Diagnosis) -> str:
    parts = [_paragraph(number, fault) for number, fault in enumerate(found.faults, start=1)]
    ignored = len(found.faults) - len(found.open)
    named = f"{len(found.open)} named" if found.open else found.judgement.sentence
    named += f", {ignored} ignored" if ignored else ""
    failed = f", {len(found.failed)} failed" if found.failed else ""
    aside = f" of {found.sessions + found.left_aside}" if found.left_aside else ""
    marks = f"; {found.landmarks}" if found.landmarks else ""
    return "\n\n".join([*parts, f"faults: {named} (sessions: {found.sessions}{aside}{failed}){marks}"])


def _paragraph(number: int, fault: Fault) -> str:
    lines = [f"{number}. {fault.summary[:1].upper()}{fault.summary[1:]}.", f"   evidence: {fault.evidence}"]
    if fault.ignored:
        return "\n".join([*lines, f"   ignored: {fault.ignored}"])
    if fault.gain is not None:
        lines.append(f"   effect of the correction: {_gain(fault.gain)}")
    if fault.corrections:
        lines.append("   lines for corrections.toml:")
        lines += [f"     {line}" for line in fault.lines.splitlines()]
    return "\n".join(line.rstrip() for line in lines)


def _gain(gain: Gain) -> str:
    said = f"{100 * gain.labelled_before:.0f} % -> {100 * gain.labelled_after:.0f} % of frames labelled"
    if gain.expected_before_m is not None and gain.expected_after_m is not None:
        said += f", expected error {gain.expected_before_m:.2f} -> {gain.expected_after_m:.2f} m"
    return said


@command
def survey_landmarks_command(
    *,
    survey: SurveyFolder,
    out: Path = option(..., "Landmark file to write or replace.", metavar="FILE"),
    floor: tuple[int, ...] = option(
        (), "Only walks that start on this floor; repeatable. FILE still contains all floors."
    ),
    jobs: Jobs = ALL_CORES,
    json: AsJson = False,
    config: ConfigFile = None,
    use_planned: bool | None = setting("survey.use_planned"),
    report: Path | None = option(None, "Write all results about landmarks and walks as JSON.", metavar="FILE"),
) -> None:
    """Estimate the positions of unsurveyed landmarks from all walks together.

    Measure three or more landmarks well apart. Leave x and y of the others empty in marker_dict.csv, or omit their
    rows. Walk past all of them. Each then gets a position, a heading and their standard deviations. FILE contains all
    landmarks of all floors. Surveyed positions are not changed. The errors that landmarks share are written beside
    FILE, with the ending .covariance.parquet. `process --landmarks FILE` reads both. The survey is not changed.

    Exit code: 0 estimated, 1 a session cannot be read or connected to the surveyed landmarks, 2 wrong usage or not a
    survey, 3 no session could be used, 130 interrupted, nothing written.

    \b
    Examples:
      vislam2tag survey-landmarks survey --out completed.csv
      vislam2tag survey-landmarks survey --out completed.csv \\
          --report landmarks.json --floor 1
      vislam2tag process survey --out labels --landmarks completed.csv
    """
    from vislam2tag.pipeline.labels.landmark_results import (
        check_targets,
        landmark_survey,
        shared_errors,
        write_completed,
    )

    check_targets(survey, out, *([] if report is None else [report]))
    settings = settings_of(config, {"survey.use_planned": use_planned}, survey)
    with session_bar("sessions") as bar:
        advance = lambda session, total: bar.advance(total, session.error)
        joint = api.survey_landmarks(survey, settings, floors=floor, jobs=jobs, progress=advance)
    result = landmark_survey(joint)
    write_completed(result, out, report, shared_errors(joint))
    all_used = bool(result.sessions) and all(session.used for session in result.sessions)
    answer(
        result,
        json,
        lambda: _print(result, survey, out),
        failed=not all_used,
        nothing=not any(session.used for session in result.sessions),
    )


def _print(result: LandmarkSurvey, survey: Path, out: Path) -> None:
    show_table(_table(result))
    for session in result.sessions:
        if session.note:
            say(f"floor {session.floor} / {session.device} / {session.session}: {session.note}")
    for odd in result.references.odd:
        say(f"outlier: {odd.summary}")
    surveyed = sum(row.surveyed for row in result.landmarks)
    placed = sum(row.x_m is not None for row in result.landmarks) - surveyed
    used = sum(session.used for session in result.sessions)
    say(
        f"{len(result.landmarks)} landmarks: {surveyed} surveyed, {placed} estimated, "
        f"{len(result.landmarks) - surveyed - placed} without a position; "
        f"{used} of {len(result.sessions)} sessions used"
    )
    say(f"landmarks: {out}")
    next_step("survey-landmarks" if used else "process, failed", survey=survey, landmarks=out)


def _table(result: LandmarkSurvey) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(title="Landmarks (metres)", title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("landmark", overflow="fold")
    for name in ("floor", "x", "y", "sigma", "sessions", "observations"):
        table.add_column(name, justify="right")
    table.add_column("position")
    table.add_column("error", justify="right")
    table.add_column("note", overflow="fold")
    for row in result.landmarks:
        table.add_row(*_cells(row))
    return table


def _cells(row: LandmarkRow) -> tuple[str, ...]:
    from rich.markup import escape

    numbers = tuple("-" if number is None else f"{number:.2f}" for number in (row.x_m, row.y_m, row.sigma_m))
    source = "surveyed" if row.surveyed else "estimated" if row.x_m is not None else "[red]none[/]"
    off = "-"
    if row.discrepancy_m is not None and row.discrepancy_sigma_m is not None:
        off = f"{row.discrepancy_m:.2f} ± {row.discrepancy_sigma_m:.2f}"
    counts = (str(row.sessions), str(row.passes))
    return (escape(row.landmark), str(row.floor), *numbers, *counts, source, off, escape(row.note))
