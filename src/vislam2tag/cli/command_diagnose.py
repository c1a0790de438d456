"""``vislam2tag diagnose``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import ALL_CORES, AsJson, FollowLinks, Jobs, SurveyFolder
from vislam2tag.cli.progress import outputs_of_interrupted, session_bar
from vislam2tag.cli.records import command, option
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_from
from vislam2tag.cli.tables import print_warnings
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.errors import UsageError
from vislam2tag.common.judgement import Answer

if TYPE_CHECKING:
    from vislam2tag.quality.diagnosis.record import Diagnosis, Fault, Gain
    from vislam2tag.settings import Settings


@dataclass(frozen=True, kw_only=True)
class DiagnoseOptions:
    """Arguments and options of ``vislam2tag diagnose``."""

    survey: SurveyFolder
    apply: bool = option(False, "Add the corrections to the survey's corrections.toml.")
    revert: bool = option(False, "Take out what --apply added, and do nothing else.")
    conflicts: Path | None = option(None, "Write a page that maps what agrees and what contradicts.", metavar="FILE")
    follow_links: FollowLinks = False
    json: AsJson = False
    jobs: Jobs = ALL_CORES
    config: ConfigFile = None
    use_planned: bool | None = setting("survey.use_planned")


@command
def diagnose_command(given: DiagnoseOptions) -> None:
    """Say what is wrong with a survey, how that is known, and the lines for corrections.toml that correct it.

    No ground truth is needed: walks that pass the same landmarks tell which of them hang elsewhere than the table says
    (docs/how-to/diagnosis.md). Named are landmarks in each other's place, mis-surveyed, moved since a date, or with one
    id twice; landmark tables that are mirrored or in another unit than metres; sessions in another floor's or device's
    folder; phones that deliver old scans again, and the odd one out: a surveyed place, what one walk or all of a day
    saw of a landmark, or what a device takes for a metre, that all others contradict.

    "Nothing is wrong" comes with what was looked at. Where no walk passes enough landmarks the answer is that nothing
    could be judged.

    Exit code: 0 nothing is wrong, 1 something is, a session cannot be read, or nothing could be judged, 2 wrong usage
    or not a survey, 130 interrupted; with --apply and --revert 0 where that was done.

    \b
    Examples:
      vislam2tag diagnose survey
      vislam2tag diagnose survey --conflicts conflicts.html
      vislam2tag diagnose survey --apply
      vislam2tag diagnose survey --revert
    """
    from vislam2tag.pipeline.labels.diagnose import diagnose
    from vislam2tag.pipeline.labels.landmark_results import check_targets
    from vislam2tag.site.corrections.edits import add_entries
    from vislam2tag.site.corrections.file import CORRECTIONS_FILE

    if given.apply and given.revert:
        raise UsageError("--apply and --revert: give one of them")
    if given.revert:
        _revert(given)
    check_targets(given.survey, *([] if given.conflicts is None else [given.conflicts]))
    settings = settings_from(given, given.survey)
    with outputs_of_interrupted(), session_bar("sessions") as bar:
        advance = lambda session, total: bar.advance(total, session.error)
        found = diagnose(given.survey, settings, jobs=given.jobs, progress=advance)
    if given.conflicts is not None:
        _write_conflicts(given.conflicts, given, settings, found)
    if not given.json:
        say(_text(found))
    lines = "\n\n".join(fault.lines for fault in found.faults if fault.corrections)
    if given.apply and lines:
        add_entries(given.survey, lines)
        added = "corrections added; --revert takes them out"
        say(f"{given.survey / CORRECTIONS_FILE}: {added}", err=given.json)
    failed = not (_is_sound(found) or (given.apply and lines))
    show = lambda: next_step(_after(found, given.apply), survey=given.survey)
    answer(found, given.json, show, failed=failed)


def _revert(given: DiagnoseOptions) -> None:
    from vislam2tag.site.corrections.edits import remove_added
    from vislam2tag.site.corrections.file import CORRECTIONS_FILE

    removed, file = remove_added(given.survey), given.survey / CORRECTIONS_FILE

    def show() -> None:
        say(f"{file}: {'as before' if removed else 'nothing was added to it'}")
        next_step("diagnose", survey=given.survey)

    answer({"corrections": file, "removed": removed}, given.json, show)


def _is_sound(found: Diagnosis) -> bool:
    return found.judgement.answer is Answer.NOTHING_WRONG and not found.failed


def _after(found: Diagnosis, applied: bool) -> str:
    """Name what to go on with."""
    if found.correctable:
        return "diagnose" if applied else "diagnose, faults"
    if found.faults:
        return "diagnose, by hand"
    return "diagnose" if _is_sound(found) else "diagnose, not judged"


def _write_conflicts(page: Path, given: DiagnoseOptions, settings: Settings, found: Diagnosis) -> None:
    from vislam2tag.sessions.registry import open_survey
    from vislam2tag.site.links import left_out_of, shared_survey
    from vislam2tag.views.conflict_page import write_conflict_page

    opened = open_survey(given.survey, settings.survey.landmark_sigma_m, use_planned=settings.survey.use_planned)
    shown = shared_survey(opened, follow_links=given.follow_links)
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
