"""``vislam2tag diagnose``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.interrupted import outputs_of_interrupted
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import ALL_CORES, AsJson, FollowLinks, Jobs, SurveyFolder
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import print_warnings
from vislam2tag.cli.terminal import say, say_json
from vislam2tag.common.judgement import Answer

if TYPE_CHECKING:
    from vislam2tag.diagnosis.record import Diagnosis, Fault, Gain
    from vislam2tag.settings import Settings

HELP = """
Say what is wrong with a survey, how that is known, and the lines for corrections.toml that correct it.

No ground truth is needed: walks that pass the same landmarks tell which of them hang elsewhere than the table says
(docs/how-to/diagnosis.md). Named are landmarks in each other's place, mis-surveyed, moved since a date, or with one id
twice; landmark tables that are mirrored or in another unit than metres; sessions in another floor's or device's folder;
phones that deliver old scans again, and the odd one out: a surveyed place, what one walk or all of a day saw of a
landmark, or what a device takes for a metre, that all others contradict.

"Nothing is wrong" comes with what was looked at. Where no walk passes enough landmarks the answer is that nothing
could be judged.

Exit code: 0 nothing is wrong, 1 something is, a session cannot be read, or nothing could be judged, 2 wrong usage or
not a survey, 130 interrupted; with --apply and --revert 0 where that was done.

\b
Examples:
  vislam2tag diagnose survey
  vislam2tag diagnose survey --conflicts conflicts.html
  vislam2tag diagnose survey --apply
  vislam2tag diagnose survey --revert
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("diagnose", help=HELP)(_diagnose)


def _diagnose(
    survey: SurveyFolder,
    apply: Annotated[
        bool, typer.Option("--apply", help="Add the corrections to the survey's corrections.toml.")
    ] = False,
    revert: Annotated[bool, typer.Option("--revert", help="Take out what --apply added, and do nothing else.")] = False,
    conflicts: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a page that maps what agrees and what contradicts.")
    ] = None,
    follow_links: FollowLinks = False,
    json: AsJson = False,
    jobs: Jobs = ALL_CORES,
    config: ConfigFile = None,
    use_planned: Annotated[bool | None, setting("survey.use_planned")] = None,
) -> None:
    from vislam2tag.common.errors import UsageError
    from vislam2tag.pipeline.labels.landmark_results import check_targets
    from vislam2tag.survey.corrections.file import CORRECTIONS_FILE
    from vislam2tag.survey.corrections.lines import add_entries, remove_added

    if apply and revert:
        raise UsageError("--apply and --revert: give one of them")
    if revert:
        removed = remove_added(survey)
        if json:
            say_json({"corrections": survey / CORRECTIONS_FILE, "removed": removed})
            return
        say(f"{survey / CORRECTIONS_FILE}: {'as before' if removed else 'nothing was added to it'}")
        next_step("diagnose", survey=survey)
        return
    check_targets(survey, *([] if conflicts is None else [conflicts]))
    settings = settings_of(config, {"survey.use_planned": use_planned}, survey)
    with outputs_of_interrupted():
        found = _with_progress(survey, settings, jobs)
    if conflicts is not None:
        _write_conflicts(conflicts, survey, settings, found, follow_links)
    if json:
        say_json(found)
    else:
        for line in _text(found).split("\n"):
            say(line)
    lines = "\n\n".join(fault.lines for fault in found.faults if fault.corrections)
    if apply and lines:
        add_entries(survey, lines)
        say(f"{survey / CORRECTIONS_FILE}: corrections added; --revert takes them out", err=json)
    if not json:
        next_step(_after(found, apply), survey=survey)
    raise typer.Exit(0 if _is_sound(found) or (apply and lines) else 1)


def _is_sound(found: Diagnosis) -> bool:
    return found.judgement.answer is Answer.NOTHING_WRONG and not found.failed


def _after(found: Diagnosis, applied: bool) -> str:
    """Name what to go on with."""
    if found.correctable:
        return "diagnose" if applied else "diagnose, faults"
    if found.faults:
        return "diagnose, by hand"
    return "diagnose" if _is_sound(found) else "diagnose, not judged"


def _with_progress(survey: Path, settings: Settings, jobs: int) -> Diagnosis:
    """Diagnose behind a progress bar; a line on standard error for each session that fails."""
    from vislam2tag.pipeline.labels.diagnose import diagnose

    with session_bar("sessions") as bar:
        return diagnose(survey, settings, jobs=jobs, progress=lambda session, total: bar.advance(total, session.error))


def _write_conflicts(page: Path, survey: Path, settings: Settings, found: Diagnosis, follow_links: bool) -> None:
    from vislam2tag.report.pages.conflict_page import write_conflict_page
    from vislam2tag.sessions.registry import open_survey
    from vislam2tag.survey.links import left_out_of, shared_survey

    opened = open_survey(survey, settings.survey.landmark_sigma_m, use_planned=settings.survey.use_planned)
    shown = shared_survey(opened, follow_links=follow_links)
    print_warnings(left_out_of(shown.findings))
    write_conflict_page(page, shown, found.references)
    say(f"conflicts: {page}", err=True)


def _text(found: Diagnosis) -> str:
    parts = [_paragraph(number, fault) for number, fault in enumerate(found.faults, start=1)]
    named = f"{len(found.faults)} named" if found.faults else found.judgement.sentence
    failed = f", {len(found.failed)} failed" if found.failed else ""
    aside = f" of {found.sessions + found.left_aside}" if found.left_aside else ""
    marks = f"; {found.landmarks}" if found.landmarks else ""
    return "\n\n".join([*parts, f"faults: {named} (sessions: {found.sessions}{aside}{failed}){marks}"])


def _paragraph(number: int, fault: Fault) -> str:
    lines = [f"{number}. {fault.summary[:1].upper()}{fault.summary[1:]}.", f"   known by: {fault.evidence}"]
    if fault.gain is not None:
        lines.append(f"   it brings: {_gain(fault.gain)}")
    if fault.corrections:
        lines.append("   for corrections.toml:")
        lines += [f"     {line}" for line in fault.lines.splitlines()]
    return "\n".join(line.rstrip() for line in lines)


def _gain(gain: Gain) -> str:
    said = f"{100 * gain.labelled_before:.0f} % -> {100 * gain.labelled_after:.0f} % of frames labelled"
    if gain.expected_before_m is not None and gain.expected_after_m is not None:
        said += f", error to expect {gain.expected_before_m:.2f} -> {gain.expected_after_m:.2f} m"
    return said
