"""``vislam2tag fleet``: add, list, process, status, report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    ConfigFile,
    DryRun,
    ExecutorOptions,
    FollowLinks,
    Jobs,
    settings_of,
)
from vislam2tag.cli.progress import interrupted_with, session_bar
from vislam2tag.cli.records import argument, command, group, option
from vislam2tag.cli.tables import print_table, print_warnings
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.documentation import with_pages
from vislam2tag.common.files.store import shown
from vislam2tag.common.findings import counted

_SOME = 5
"""Number of files named in a line."""
Store = Annotated[Path, typer.Argument(metavar="STORE", help="Folder of the fleet, or its address in object storage.")]


@command
def add_command(
    *,
    store: Store,
    surveys: tuple[Path, ...] = argument("Survey folders or addresses.", (), metavar="[SURVEY]..."),
    name: str | None = option(None, "Name in the fleet, for a single SURVEY."),
    replace: bool = option(False, "Replace files that differ. Old versions are kept in STORE/replaced/NAME."),
    follow_links: FollowLinks = False,
    json: AsJson = False,
) -> None:
    """Add surveys to a fleet's catalogue. The first one creates it.

    A SURVEY outside STORE, a folder or an address, is copied to STORE/surveys/NAME. NAME is its folder's name, or
    --name. If the fleet already contains a survey of this name, new files are added. Files that differ are refused
    without --replace, and so are surveys without a common session. Raw files are never deleted: --replace keeps old
    versions in STORE/replaced/NAME.

    Without SURVEY, the command scans all surveys in STORE/surveys for new and changed files.

    Exit code: 0 added, 2 wrong usage, not a survey, or another survey of that name, 130 interrupted.

    \b
    Examples:
      vislam2tag fleet add s3://walks/hospitals survey-of-ward-7
      vislam2tag fleet add s3://walks/hospitals north/ward-7 --name ward-7-north
      vislam2tag fleet add s3://walks/hospitals
    """
    changes: list[api.AddedSurvey] = []
    with session_bar("surveys") as bar:

        def advance(done: api.AddedSurvey, total: int) -> None:
            changes.append(done)
            bar.advance(total, None)

        totals = api.fleet_add(
            store,
            surveys,
            name=name,
            replace=replace,
            follow_links=follow_links,
            progress=advance,
            tell=print_warnings,
        )
    listed = changes if surveys else []

    def show() -> None:
        for each in listed:
            _print_changes(store, each)
        _print_totals(totals)
        next_step("fleet add", fleet=store)

    answer(totals.model_dump() | {"changes": listed}, json, show)


def _print_changes(store: Path, changes: api.AddedSurvey) -> None:
    kinds = ("added", "unchanged", "replaced", "left_alone")
    counts = (f"{len(getattr(changes, kind))} {kind.replace('_', ' ')}" for kind in kinds)
    say(f"{changes.survey}: files: {', '.join(counts)}")
    if changes.replaced:
        kept = shown(store / "replaced" / changes.survey)
        say(f"  replaced, old versions are kept in {kept}: {_some(changes.replaced)}")
    if changes.left_alone:
        say(f"  only in the fleet, not changed: {_some(changes.left_alone)}")


def _some(names: tuple[str, ...]) -> str:
    more = f" and {len(names) - _SOME} more" if len(names) > _SOME else ""
    return f"{', '.join(names[:_SOME])}{more}"


@command
def list_command(
    *,
    store: Store,
    json: AsJson = False,
) -> None:
    """List a fleet's surveys: site, floors, devices, dates, sessions and state.

    Exit code: 0 listed, 2 no fleet in STORE.

    \b
    Example:
      vislam2tag fleet list s3://walks/hospitals --json
    """
    rows = api.fleet_list(store).to_dicts()
    answer(rows, json, lambda: _print_list(rows, store))


def _print_list(rows: list[dict[str, Any]], store: Path) -> None:
    cells = []
    for row in rows:
        dates = " to ".join(dict.fromkeys(str(row[name]) for name in ("first_date", "last_date") if row[name]))
        texts = (row["survey"], row["site"], row["state"], ", ".join(row["devices"]), dates or "-")
        cells.append((*texts, str(len(row["floors"])), str(row["sessions"]), str(row["failed"])))
    heads = ("survey", "site", "state", "devices", "dates")
    print_table("Surveys", heads, ("floors", "sessions", "failed"), cells)
    for row in rows:
        if row["error"]:
            say(f"{row['survey']}: {row['error']}")
    next_step("fleet list", fleet=store)


@dataclass(frozen=True, kw_only=True)
class FleetProcessOptions:
    """Arguments and options of ``vislam2tag fleet process``."""

    store: Store
    survey: tuple[str, ...] = option((), "Name of a survey to process; repeatable.")
    dry_run: DryRun = False
    follow_links: FollowLinks = False
    jobs: Jobs = ALL_CORES
    where: ExecutorOptions
    json: AsJson = False
    config: ConfigFile = None


@command
def process_command(given: FleetProcessOptions) -> None:
    """Map and label all sessions of a fleet that are new or changed.

    Writes STORE/labels/SURVEY (see process), STORE/tables (by survey and floor), STORE/report and the catalogue.
    Settings come from --config, or from the vislam2tag.toml of each survey. After an interruption, run the same command
    on any machine to continue.

    Exit code: 0 all processed, 1 a survey cannot be read, or process would end with 1 or 3 for it, 2 wrong usage, 3 the
    fleet is empty, 130 interrupted.

    \b
    Examples:
      vislam2tag fleet process fleet
      vislam2tag fleet process s3://walks/hospitals --executor dask \\
          --scheduler tcp://10.0.0.5:8786
    """
    with given.where.opened(given.jobs) as executor:
        if given.dry_run:
            _print_dry_run(given, executor)
        totals, failed = _process_with_progress(given, executor)
    failed = failed or not totals.surveys

    def show() -> None:
        _print_totals(totals)
        after = "fleet process, failed" if failed else "fleet process"
        next_step(after, fleet=given.store, page=given.store / "report" / "index.html")

    answer(totals, given.json, show, failed=failed, nothing=not totals.surveys)


def _print_dry_run(given: FleetProcessOptions, executor: api.Executor) -> None:
    from vislam2tag.pipeline.fleet.process import fleet_dry_run

    settings = lambda folder: settings_of(given.config, {}, folder)
    planned = list(fleet_dry_run(given.store, settings, surveys=given.survey, executor=executor))
    some = any(one.to_process or one.kept for one in planned)

    def show() -> None:
        for one in planned:
            why = one.error or ", ".join(f"{count} {reason}" for reason, count in one.reasons.items())
            say(f"{one.survey}: {one.to_process} sessions to process, {one.kept} unchanged{f' ({why})' if why else ''}")
        next_step("fleet process, dry run" if some else "fleet process, failed", fleet=given.store)

    answer(planned, given.json, show, nothing=not some)


def _process_with_progress(given: FleetProcessOptions, executor: api.Executor) -> tuple[api.FleetTotals, bool]:
    """Process; return the fleet's totals, and whether anything of this run failed."""

    def there() -> str:
        kept = f"{bar.done} sessions are finished and kept in {shown(given.store)}"
        return f"{kept}; run the same command again to continue"

    with session_bar("sessions", lines=True) as bar, interrupted_with(there):

        def advance(done: Any, total: int) -> None:
            if isinstance(done, api.SessionOutcome):
                bar.advance(total, done.error, done.outcome.rows)
            elif done.problem is not None:
                bar.fail(done.problem)

        totals = api.fleet_process(
            given.store,
            lambda folder: settings_of(given.config, {}, folder),
            surveys=given.survey,
            executor=executor,
            follow_links=given.follow_links,
            progress=advance,
        )
    return totals, bar.failed > 0


@command
def status_command(
    *,
    store: Store,
    json: AsJson = False,
) -> None:
    """Show the progress of a fleet: surveys and sessions by state.

    Reads one small file, so it is quick for any number of surveys.

    Exit code: 0 shown, 2 no fleet in STORE.

    \b
    Example:
      vislam2tag fleet status s3://walks/hospitals
    """
    totals = api.fleet_status(store)

    def show() -> None:
        _print_totals(totals)
        next_step("fleet status", fleet=store)

    answer(totals, json, show)


@command
def report_command(
    *,
    store: Store,
    json: AsJson = False,
) -> None:
    """Write the pages about a whole fleet: STORE/report/index.html.

    `fleet process` writes the pages of surveys and sessions.

    Exit code: 0 written, 2 no fleet in STORE.

    \b
    Example:
      vislam2tag fleet report s3://walks/hospitals
    """
    pages, page = api.fleet_report(store), store / "report" / "index.html"

    def show() -> None:
        say(f"report: {shown(page)}")
        next_step("fleet report", page=page)

    answer({"page": shown(page), "pages": pages}, json, show)


def _print_totals(totals: api.FleetTotals) -> None:
    say(f"{counted(totals.surveys, 'survey')}, {counted(totals.sessions, 'session')} ({totals.failed} failed)")
    for state, number in totals.states.items():
        say(f"{state}: {counted(number, 'survey')}, {counted(totals.sessions_by_state[state], 'session')}")
    if totals.frames:
        share = totals.frames_labelled / totals.frames
        say(
            f"{totals.duration_s / 3600:.1f} h, {totals.distance_m / 1000:.1f} km; frames labelled: {100 * share:.1f} %"
        )


fleet_command = group(
    with_pages("Process many surveys in one store with a catalogue (docs/how-to/many-surveys.md).")
    + "\n\nSTORE is a folder or an address in object storage.",
    ("add", "Add surveys to the catalogue.", add_command),
    ("list", "List the surveys.", list_command),
    ("process", "Map and label all sessions.", process_command),
    ("status", "Show the progress.", status_command),
    ("report", "Write the report pages.", report_command),
)
