"""``vislam2tag fleet``: add, list, process, status, report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from vislam2tag.cli.executors import ClusterFile, ExecutorName, SchedulerAddress, WhereSessionsRun, executor_of
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import ALL_CORES, INTERRUPTED, AsJson, DryRun, FollowLinks, Jobs
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.settings_options import ConfigFile, settings_of
from vislam2tag.cli.tables import print_warnings, table, table_console
from vislam2tag.cli.terminal import say, say_json
from vislam2tag.common.files.store import shown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from vislam2tag.pipeline.fleet.catalogue import FleetTotals
    from vislam2tag.pipeline.fleet.process import PlannedSurvey
    from vislam2tag.pipeline.fleet.raw_copy import AddedSurvey
    from vislam2tag.pipeline.run.workers import Executor

HELP = """
Many surveys under one prefix, with a catalogue (docs/how-to/many-surveys.md).

STORE is a folder, or the address of one in object storage.
"""
ADD_HELP = """
Enter surveys into a fleet's catalogue, which begins with the first.

A SURVEY that is elsewhere, a folder or an address, is first copied to STORE/surveys/NAME, by its folder's name or by
--name. If STORE contains a survey of that name, new files are added to it and all others stay. Files that differ are
refused without --replace, and so is a survey that has no session in common with the one in STORE. Raw files are never
removed: former versions of replaced ones are kept in STORE/replaced/NAME.

Without any SURVEY, all surveys in STORE/surveys are looked at again: what is new, and what has changed.

Exit code: 0 all right, 2 wrong usage, not a survey, another survey of that name, or STORE cannot be read or written.

\b
Examples:
  vislam2tag fleet add s3://walks/hospitals survey-of-ward-7
  vislam2tag fleet add s3://walks/hospitals north/ward-7 --name ward-7-north
  vislam2tag fleet add s3://walks/hospitals
"""
LIST_HELP = """
List a fleet's surveys: site, floors, devices, dates, sessions and state.

Exit code: 0 all right, 2 no fleet is there.

\b
Example:
  vislam2tag fleet list s3://walks/hospitals --json
"""
PROCESS_HELP = """
Map every session of a fleet's surveys; what is done and unchanged is not repeated.

Writes STORE/labels/SURVEY (as process), STORE/tables (by survey and floor), STORE/report and the catalogue. Settings
are those of --config, or of the vislam2tag.toml in each survey.

Exit code: 0 all right, 1 a survey cannot be read, or process would end with 1 for it, 2 wrong usage, or STORE cannot
be read or written, 130 interrupted. Whatever ended a run early, the same command goes on, from any machine.

\b
Examples:
  vislam2tag fleet process fleet
  vislam2tag fleet process s3://walks/hospitals --executor dask \\
      --scheduler tcp://10.0.0.5:8786
"""
STATUS_HELP = """
Say how far a fleet is, by one small file: surveys and sessions by state.

Exit code: 0 all right, 2 no fleet is there.

\b
Example:
  vislam2tag fleet status s3://walks/hospitals
"""
REPORT_HELP = """
Write the pages about a fleet as a whole, STORE/report/index.html; those of surveys and sessions come of process.

Exit code: 0 all right, 2 no fleet is there, or STORE cannot be written.

\b
Example:
  vislam2tag fleet report s3://walks/hospitals
"""
_SOME = 5
"""Files that are named in a line."""
Store = Annotated[Path, typer.Argument(metavar="STORE", help="Folder of the fleet, or its address.")]


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    fleet = typer.Typer(help=HELP, no_args_is_help=True, rich_markup_mode=None)
    fleet.command("add", help=ADD_HELP, short_help="Enter surveys into its catalogue.")(_add)
    fleet.command("list", help=LIST_HELP, short_help="List its surveys.")(_list)
    fleet.command("process", help=PROCESS_HELP, short_help="Map every session.")(_process)
    fleet.command("status", help=STATUS_HELP, short_help="How far it is.")(_status)
    fleet.command("report", help=REPORT_HELP, short_help="Write the pages about it.")(_report)
    app.add_typer(fleet, name="fleet")


def _add(
    store: Store,
    surveys: Annotated[list[Path] | None, typer.Argument(metavar="[SURVEY]...", help="Folders or addresses.")] = None,
    name: Annotated[str | None, typer.Option(help="The survey's name in the fleet, for a single SURVEY.")] = None,
    replace: Annotated[
        bool,
        typer.Option("--replace", help="Replace files that differ; the former ones are kept in STORE/replaced/NAME."),
    ] = False,
    follow_links: FollowLinks = False,
    json: AsJson = False,
) -> None:
    from vislam2tag.pipeline.fleet.add import add_surveys

    changes: list[AddedSurvey] = []
    with session_bar("surveys") as bar:

        def advance(done: AddedSurvey, total: int) -> None:
            changes.append(done)
            bar.advance(total, None)

        totals = add_surveys(
            store,
            surveys or (),
            name=name,
            replace=replace,
            follow_links=follow_links,
            progress=advance,
            tell=print_warnings,
        )
    if json:
        say_json(totals.model_dump() | {"changes": changes if surveys else []})
        return
    for each in changes if surveys else ():
        _print_changes(store, each)
    _print_totals(totals, json)
    next_step("fleet add", fleet=store)


def _print_changes(store: Path, changes: AddedSurvey) -> None:
    kinds = ("added", "unchanged", "replaced", "left_alone")
    counts = (f"{len(getattr(changes, kind))} {kind.replace('_', ' ')}" for kind in kinds)
    say(f"{changes.survey}: files: {', '.join(counts)}")
    if changes.replaced:
        kept = shown(store / "replaced" / changes.survey)
        say(f"  replaced, the former versions are kept in {kept}: {_some(changes.replaced)}")
    if changes.left_alone:
        say(f"  left alone, only the fleet has them: {_some(changes.left_alone)}")


def _some(names: tuple[str, ...]) -> str:
    more = f" and {len(names) - _SOME} more" if len(names) > _SOME else ""
    return f"{', '.join(names[:_SOME])}{more}"


def _list(store: Store, json: AsJson = False) -> None:
    from vislam2tag.pipeline.fleet.catalogue import fleet_list

    rows = fleet_list(store).to_dicts()
    if json:
        say_json(rows)
        return
    from rich.markup import escape

    shown_rows = table("Surveys", ("survey", "site", "state", "devices", "dates"), ("floors", "sessions", "failed"))
    for row in rows:
        dates = " to ".join(dict.fromkeys(str(row[name]) for name in ("first_date", "last_date") if row[name]))
        texts = (row["survey"], row["site"], row["state"], ", ".join(row["devices"]), dates or "-")
        numbers = (len(row["floors"]), row["sessions"], row["failed"])
        shown_rows.add_row(*map(escape, texts), *map(str, numbers))
    table_console().print(shown_rows)
    for row in rows:
        if row["error"]:
            say(f"{row['survey']}: {row['error']}")
    next_step("fleet list", fleet=store)


def _process(
    store: Store,
    survey: Annotated[list[str] | None, typer.Option(help="Only this survey, by its name; repeatable.")] = None,
    dry_run: DryRun = False,
    follow_links: FollowLinks = False,
    jobs: Jobs = ALL_CORES,
    executor: WhereSessionsRun = ExecutorName.LOCAL,
    scheduler: SchedulerAddress = None,
    cluster: ClusterFile = None,
    json: AsJson = False,
    config: ConfigFile = None,
) -> None:
    with executor_of(executor, scheduler, cluster, jobs) as run_all:
        if dry_run:
            _print_dry_run(store, tuple(survey or ()), config, run_all, json)
            return
        totals, failed = _process_with_progress(store, tuple(survey or ()), config, run_all, follow_links)
    failed = failed or not totals.surveys
    _print_totals(totals, json)
    if not json:
        after = "fleet process, failed" if failed else "fleet process"
        next_step(after, fleet=store, page=store / "report" / "index.html")
    raise typer.Exit(1 if failed else 0)


def _print_dry_run(store: Path, surveys: tuple[str, ...], config: Path | None, executor: Executor, json: bool) -> None:
    from vislam2tag.pipeline.fleet.process import fleet_dry_run

    planned = list(
        fleet_dry_run(store, lambda folder: settings_of(config, {}, folder), surveys=surveys, executor=executor)
    )
    if json:
        say_json(planned)
        raise typer.Exit(0 if _any_session(planned) else 1)
    for one in planned:
        why = one.error or ", ".join(f"{count} {reason}" for reason, count in one.reasons.items())
        say(f"{one.survey}: would process {one.to_process}, keep {one.kept}{f' ({why})' if why else ''}")
    some = _any_session(planned)
    next_step("fleet process, dry run" if some else "fleet process, failed", fleet=store)
    raise typer.Exit(0 if some else 1)


def _any_session(planned: Sequence[PlannedSurvey]) -> bool:
    return any(one.to_process or one.kept for one in planned)


def _process_with_progress(
    store: Path, surveys: tuple[str, ...], config: Path | None, executor: Executor, follow_links: bool
) -> tuple[FleetTotals, bool]:
    """Process; return the fleet's totals, and whether anything of this run failed."""
    from vislam2tag.pipeline.fleet.process import SessionOutcome, process_fleet

    with session_bar("sessions", lines=True) as bar:

        def advance(done: Any, total: int) -> None:
            if isinstance(done, SessionOutcome):
                bar.advance(total, done.error, done.outcome.rows)
            elif done.problem is not None:
                bar.fail(done.problem)

        try:
            totals = process_fleet(
                store,
                lambda folder: settings_of(config, {}, folder),
                surveys=surveys,
                executor=executor,
                follow_links=follow_links,
                progress=advance,
            )
        except KeyboardInterrupt:
            say(
                f"interrupted: {bar.done} sessions are done and kept in {shown(store)}; run the same command again to "
                "go on",
                err=True,
            )
            raise typer.Exit(INTERRUPTED) from None
    return totals, bar.failed > 0


def _status(store: Store, json: AsJson = False) -> None:
    from vislam2tag.pipeline.fleet.catalogue import fleet_status

    _print_totals(fleet_status(store), json)
    if not json:
        next_step("fleet status", fleet=store)


def _report(store: Store, json: AsJson = False) -> None:
    from vislam2tag.pipeline.fleet.reduction import write_fleet_report

    pages, page = write_fleet_report(store), store / "report" / "index.html"
    if json:
        say_json({"page": shown(page), "pages": pages})
        return
    say(f"report: {shown(page)}")
    next_step("fleet report", page=page)


def _print_totals(totals: FleetTotals, json: bool) -> None:
    if json:
        say_json(totals)
        return
    say(f"{totals.surveys} surveys, {totals.sessions} sessions ({totals.failed} failed)")
    for state, number in totals.states.items():
        say(f"{state}: {number} surveys, {totals.sessions_by_state[state]} sessions")
    if totals.frames:
        share = totals.frames_labelled / totals.frames
        say(
            f"{totals.duration_s / 3600:.1f} h, {totals.distance_m / 1000:.1f} km; frames labelled: {100 * share:.1f} %"
        )
