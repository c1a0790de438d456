"""``vislam2tag studio``: look, find and correct in the browser."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import ALL_CORES, AsJson, FollowLinks, Jobs
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.settings_options import ConfigFile, settings_of
from vislam2tag.cli.tables import print_warnings
from vislam2tag.cli.terminal import say, say_json
from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.store import address_of, shown

if TYPE_CHECKING:
    from vislam2tag.studio.export import ExportRecord
    from vislam2tag.studio.workspace import Workspace

HELP = """
Look at a survey and its labels in the browser, find what is wrong, correct it.

Opens a page on this computer. What is changed there is a line in the survey's corrections.toml, as if typed; sessions
that it touches are mapped again into the folder of --labels, as by process. Raw files are never changed. Ctrl-C ends
it.

With --export DIR nothing is opened: DIR becomes the same page on files, which only shows, for any web server or
bucket. Names of networks, networks that opted out (_nomap) and what people wrote beside corrections are left out,
addresses of networks are hashed; what is told of the building and of devices, stays. Sessions and site files that
links lead to outside SURVEY are left out, unless --follow-links is given. Where SURVEY is a fleet, or a
fleet's address, the page is a list of its surveys to search, and the walks of each that has labels are behind it;
--survey chooses.

The address that is shown works once, for one browser; the page gives further ones. Only this computer can open it
unless --host says more: then use a network that you trust, what is sent can be read there.

Exit code: 0 ended by Ctrl-C, or DIR is written; 2 not a survey, the address cannot be listened on, a store cannot be
read, or DIR cannot be written.

\b
Examples:
  vislam2tag studio survey
  vislam2tag studio survey --labels out/labels --compare before
  vislam2tag studio survey --host 0.0.0.0
  vislam2tag studio survey --export page
  vislam2tag studio s3://walks/hospitals --export page
"""
LOOPBACK = "127.0.0.1"


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("studio", help=HELP)(_studio)


def _studio(
    survey: Annotated[
        Path,
        typer.Argument(help="Survey folder (with floor_K/DEVICE/SESSION below); with --export a fleet, too."),
    ],
    labels: Annotated[
        Path | None,
        typer.Option(help="Labels as process makes them, existing or not.  [default: SURVEY-labels beside the survey]"),
    ] = None,
    compare: Annotated[list[Path] | None, typer.Option(help="Further labels to compare with; repeatable.")] = None,
    host: Annotated[str, typer.Option(help="Address to listen on; 0.0.0.0: the whole network.")] = LOOPBACK,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on; 0: any free one.")] = 8770,
    export: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write the page as files that only show, and end; replaces an earlier one."),
    ] = None,
    hash_bssid: Annotated[
        Path | None,
        typer.Option(
            metavar="KEYFILE",
            help="With --export: hash BSSIDs with the secret of at least 16 bytes in this file.  [default: a new one]",
        ),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option("--survey", metavar="NAME", help="With --export of a fleet: only this survey; repeatable."),
    ] = None,
    follow_links: FollowLinks = False,
    browser: Annotated[bool, typer.Option(help="Open the page in this computer's browser.")] = True,
    jobs: Jobs = ALL_CORES,
    json: AsJson = False,
    config: ConfigFile = None,
) -> None:
    from vislam2tag.pipeline.fleet.catalogue import is_fleet

    if is_fleet(survey):
        if export is None or labels or compare:
            raise UsageError(
                f"{shown(survey)}: is a fleet; give --export DIR and neither --labels nor --compare, or open one of "
                f"its surveys: vislam2tag studio {shown(survey)}/surveys/NAME --labels {shown(survey)}/labels/NAME"
            )
        _export_fleet(survey, only or (), config, export, hash_bssid, follow_links, json)
        return
    if only:
        raise UsageError(f"--survey: {shown(survey)} is no fleet; leave the option out")
    if address_of(survey):
        raise UsageError(f"{shown(survey)}: is no fleet; copy the survey to this machine (docs/how-to/fleets.md)")
    workspace = _opened(survey, labels, compare or (), config)
    if export is not None:
        _export(workspace, export, hash_bssid, follow_links, json)
    else:
        _serve(workspace, host, port, browser, jobs, json)


def _opened(survey: Path, labels: Path | None, compare: Sequence[Path], config: Path | None) -> Workspace:
    from vislam2tag.studio.workspace import Workspace, beside

    out = labels or beside(survey, "labels")
    return Workspace(survey, out, settings_of(config, {}, survey), compare)


def _export_fleet(
    fleet: Path,
    only: Sequence[str],
    config: Path | None,
    out: Path,
    key: Path | None,
    follow_links: bool,
    json: bool,
) -> None:
    from vislam2tag.studio.fleet import export_fleet

    with session_bar("surveys") as bar:
        record = export_fleet(
            fleet,
            out,
            lambda folder: settings_of(config, {}, folder),
            only,
            _key(key),
            lambda _, total: bar.advance(total, None),
            follow_links=follow_links,
            tell=print_warnings,
        )
    _tell(record, out, json)


def _export(workspace: Workspace, out: Path, key: Path | None, follow_links: bool, json: bool) -> None:
    from vislam2tag.studio.export import export_survey

    with closing(workspace), session_bar("steps") as bar:
        record = export_survey(
            workspace,
            out,
            _key(key),
            lambda _, total: bar.advance(total, None),
            follow_links=follow_links,
            tell=print_warnings,
        )
    _tell(record, out, json)


def _key(file: Path | None) -> bytes | None:
    from vislam2tag.dataset.privacy import read_key

    return None if file is None else read_key(file)


def _tell(record: ExportRecord, out: Path, json: bool) -> None:
    if json:
        say_json({"export": out, **record.model_dump()})
        return
    surveys = f"{record.surveys} surveys, " if record.surveys > 1 else ""
    say(f"{out}: {surveys}{record.sessions} sessions, {record.files} files, {record.size_bytes / 1e6:.1f} MB")
    next_step("studio, export", out=out)


def _serve(workspace: Workspace, host: str, port: int, browser: bool, jobs: int, json: bool) -> None:
    # Only a server needs these; starting quickly matters to all other commands.
    import webbrowser

    from vislam2tag.common.serving import code_of, listen
    from vislam2tag.studio.app import opened_studio, serve_studio

    with (
        listen(host, port) as opened,
        opened_studio(workspace, host, opened, jobs) as (url, app),
    ):
        if json:
            say_json({"url": url, "labels": workspace.out})
        else:
            say(f"{'' if host == LOOPBACK else code_of(url)}\n{url}\n\nlabels: {workspace.out}\nCtrl-C ends it.")
        if browser:
            webbrowser.open(url)
        serve_studio(app, opened)
    if not json:
        next_step("studio", labels=workspace.out)
