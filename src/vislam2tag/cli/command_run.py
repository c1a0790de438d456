"""``vislam2tag run``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.command_process import share_text
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import ALL_CORES, AsJson, FollowLinks, Jobs, LandmarkFile, SurveyFolder
from vislam2tag.cli.progress import contents_there, interrupted_with, session_bar
from vislam2tag.cli.records import command, option
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import print_warnings
from vislam2tag.cli.terminal import answer, say

if TYPE_CHECKING:
    from vislam2tag.pipeline.survey_run import SurveyRun


_PARTS = {
    "labels/sessions": "labels",
    "diagnosis.json": "a diagnosis",
    "check/check.json": "a check",
    "dataset/dataset.json": "a data set",
    "index.html": "the page",
}


@command
def run_command(
    *,
    survey: SurveyFolder,
    out: Path = option(..., "Output folder: new, empty or from an earlier run."),
    landmarks: LandmarkFile = None,
    follow_links: FollowLinks = False,
    jobs: Jobs = ALL_CORES,
    json: AsJson = False,
    config: ConfigFile = None,
    use_planned: bool | None = setting("survey.use_planned"),
) -> None:
    """From a survey to a data set: label it, check the labels, collect them, with one page that leads to all others.

    Makes OUT/labels (as process), OUT/diagnosis.json and OUT/conflicts.html (as diagnose), OUT/check (as check),
    OUT/dataset (as dataset) and OUT/index.html, which leads to them. Run it again after correcting or adding anything:
    what is done and unchanged is kept. Each step has a command of its own with more options.

    Exit code: 0 all right (findings and faults are in the report), 1 at least one session cannot be read or mapped, no
    frame has a position, or landmark ids do not match, 2 wrong usage, not a survey, or OUT cannot be written, 130
    interrupted.

    \b
    Examples:
      vislam2tag run survey --out out
      vislam2tag run survey --out out --config settings.toml
    """
    from vislam2tag.pipeline.survey_run import run_survey

    settings = settings_of(config, {"survey.use_planned": use_planned}, survey)
    with interrupted_with(lambda: contents_there(out, _PARTS)), session_bar("sessions") as bar:

        def advance(step: tuple[str, str | None], total: int) -> None:
            bar.enter(f"sessions: {step[0]}")
            bar.advance(total, step[1])

        made = run_survey(
            survey,
            out,
            settings,
            landmarks=landmarks,
            follow_links=follow_links,
            jobs=jobs,
            progress=advance,
            tell=print_warnings,
        )
    answer(made, json, lambda: _print(made, survey, out), failed=made.labels.problem is not None)


def _print(made: SurveyRun, survey: Path, out: Path) -> None:
    labelled = share_text(made.labels.frames)
    say(f"{made.labels.sessions} sessions ({made.labels.failed} failed); frames labelled: {labelled}")
    for floor in made.check.floors:
        say(f"floor {floor.number}: mean error to expect {floor.expected_m:.2f} m")
    for bad in made.check.bad_landmarks:
        where = f" ({bad.room})" if bad.room else ""
        say(f"floor {bad.floor}: landmark {bad.landmark}{where} is off by {bad.size_m:.2f} m")
    for fault in made.faults:
        say(f"wrong: {fault}")
    if made.kept:
        say(f"unchanged and kept: {', '.join(made.kept)}")
    say(f"page: {out / 'index.html'}")
    next_step(_after(made), survey=survey, dataset=out / "dataset")


def _after(made: SurveyRun) -> str:
    """Name what to go on with."""
    if made.faults:
        return "run, faults" if made.correctable else "run, by hand"
    return "run" if made.labels.problem is None else "process, failed"
