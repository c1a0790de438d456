"""``vislam2tag studio`` and ``docs``: pages that open in the browser."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import ALL_CORES, AsJson, ConfigFile, FollowLinks, Jobs, key_of, settings_of
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import print_warnings
from vislam2tag.cli.terminal import answer, say, say_json, visible_console
from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.store import address_of, shown

if TYPE_CHECKING:
    from vislam2tag.studio.export import ExportRecord
    from vislam2tag.studio.workspace import Workspace


LOOPBACK = "127.0.0.1"


@dataclass(frozen=True, kw_only=True)
class StudioOptions:
    """Arguments and options of ``vislam2tag studio``."""

    survey: Path = argument("Survey folder (with floor_K/DEVICE/SESSION below), or a fleet with --export.")
    labels: Path | None = option(
        None, "Output folder of process, existing or new.  [default: SURVEY-labels beside the survey]"
    )
    compare: tuple[Path, ...] = option((), "Other labels to compare with; repeatable.")
    host: str = option(LOOPBACK, "Address to listen on; 0.0.0.0 for the whole network.")
    port: int = option(8770, "Port to listen on; 0 for any free port.", least=0, most=65535)
    export: Path | None = option(
        None, "Write a read-only copy of the page as files, and end. Replaces an earlier copy.", metavar="DIR"
    )
    hash_bssid: Path | None = option(
        None,
        "With --export: file with a secret of at least 16 bytes to hash BSSIDs.  [default: a new secret]",
        metavar="KEYFILE",
    )
    only: tuple[str, ...] = option(
        (), "With --export of a fleet: only this survey; repeatable.", "--survey", metavar="NAME"
    )
    follow_links: FollowLinks = False
    browser: bool = option(True, "Open the page in this computer's browser.")
    jobs: Jobs = ALL_CORES
    json: AsJson = False
    config: ConfigFile = None


@command
def studio_command(given: StudioOptions) -> None:
    """View a survey and its labels in the browser, find mistakes and correct them.

    Opens a page on this computer. Corrections are written to the survey's corrections.toml. Affected sessions are
    mapped again into the folder of --labels, as by process. Raw files are never changed. Press Ctrl-C to stop.

    --export DIR writes a read-only copy of the page for any web server or bucket. Network names, networks that opted
    out (_nomap) and notes beside corrections are removed, and network addresses are hashed. The building and the
    devices stay visible. Files that links point to outside SURVEY are skipped, unless you pass --follow-links. If
    SURVEY is a fleet or its address, the page lists its surveys, and --survey selects some.

    The printed address works once, for one browser. Only this computer can open it, unless you pass --host. Then use a
    network that you trust, because the connection is not encrypted.

    Exit code: 0 stopped by Ctrl-C, or DIR is written, 2 not a survey, or the address is not available.

    \b
    Examples:
      vislam2tag studio survey
      vislam2tag studio survey --labels out/labels --compare before
      vislam2tag studio survey --host 0.0.0.0
      vislam2tag studio survey --export page
      vislam2tag studio s3://walks/hospitals --export page
    """
    from vislam2tag.pipeline.fleet.catalogue import is_fleet

    survey = given.survey
    if is_fleet(survey):
        if given.export is None or given.labels or given.compare:
            raise UsageError(
                f"{shown(survey)}: is a fleet; pass --export DIR without --labels and --compare, or open one of "
                f"its surveys: vislam2tag studio {shown(survey)}/surveys/NAME --labels {shown(survey)}/labels/NAME"
            )
        _export_fleet(given, given.export)
    if given.only:
        raise UsageError(f"--survey: {shown(survey)} is not a fleet; remove the option")
    if address_of(survey):
        raise UsageError(
            f"{shown(survey)}: is not a fleet; copy the survey to this machine, see {page_of('how-to/many-surveys')}"
        )
    if given.export is not None:
        _export(given, given.export)
    workspace = _opened(given)
    print_warnings(workspace.of_labels)
    _serve(given, workspace)


def _opened(given: StudioOptions) -> Workspace:
    from vislam2tag.studio.workspace import Workspace, beside

    out = given.labels or beside(given.survey, "labels")
    return Workspace(given.survey, out, settings_of(given.config, {}, given.survey), given.compare)


def _export_fleet(given: StudioOptions, out: Path) -> None:
    from vislam2tag.studio.fleet import export_fleet

    with session_bar("surveys") as bar:
        record = export_fleet(
            given.survey,
            out,
            lambda folder: settings_of(given.config, {}, folder),
            given.only,
            key_of(given.hash_bssid),
            bar.count,
            follow_links=given.follow_links,
            tell=print_warnings,
        )
    _end(record, out, given.json)


def _export(given: StudioOptions, out: Path) -> None:
    from vislam2tag.studio.export import export_survey

    with closing(_opened(given)) as workspace, session_bar("steps") as bar:
        record = export_survey(
            workspace,
            out,
            key_of(given.hash_bssid),
            bar.count,
            follow_links=given.follow_links,
            tell=print_warnings,
        )
    _end(record, out, given.json)


def _end(record: ExportRecord, out: Path, as_json: bool) -> None:
    def show() -> None:
        surveys = f"{record.surveys} surveys, " if record.surveys > 1 else ""
        say(f"{out}: {surveys}{record.sessions} sessions, {record.files} files, {record.size_bytes / 1e6:.1f} MB")
        next_step("studio, export", out=out)

    answer({"export": out, **record.model_dump()}, as_json, show)


def _serve(given: StudioOptions, workspace: Workspace) -> None:
    # Only a server needs these; starting quickly matters to all other commands.
    import shlex
    import sys
    import webbrowser

    from vislam2tag.common.addresses import code_of, listen
    from vislam2tag.studio.app import opened_studio, serve_studio

    command = shlex.join(("vislam2tag", *sys.argv[1:]))
    with (
        listen(given.host, given.port) as opened,
        opened_studio(workspace, given.host, opened, given.jobs, command) as (url, app),
    ):
        if given.json:
            say_json({"url": url, "labels": workspace.out})
        else:
            code = "" if given.host == LOOPBACK else code_of(url)
            say(f"{code}\n{url}\n\nlabels: {workspace.out}\nPress Ctrl-C to stop.")
        if given.browser:
            webbrowser.open(url)
        serve_studio(app, opened)
    if not given.json:
        next_step("studio", labels=workspace.out)


@dataclass(frozen=True, kw_only=True)
class DocsOptions:
    """Arguments and options of ``vislam2tag docs``."""

    page: str = argument("Page to open, as messages name it, such as how-to/iphone.", "index")
    browser: bool = option(True, "Open the page in the browser, if the extra docs is installed.")


@command
def docs_command(given: DocsOptions) -> None:
    """Show a page of the documentation, without a network.

    Prints the page in the terminal. If the extra docs is installed, which contains the whole site with its search, the
    page opens in the browser, and its file is printed.

    Exit code: 0 the page was shown, 2 there is no such page.

    \b
    Examples:
      vislam2tag docs
      vislam2tag docs help/faq
      vislam2tag docs reference/settings --no-browser
    """
    import webbrowser

    from rich.markdown import Markdown

    from vislam2tag.common.documentation import offline_page

    page = offline_page(given.page)
    if page.suffix == ".md":
        visible_console().print(Markdown(page.read_text(encoding="utf-8")))
        return
    say(str(page))
    if given.browser:
        webbrowser.open(page.as_uri())
