"""Commands that divide, compare and join data sets: ``split``, ``verify`` and ``join``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, ConfigFile, FollowLinks, Replace, option_of, setting, settings_of
from vislam2tag.cli.progress import outputs_of_interrupted, session_bar
from vislam2tag.cli.records import argument, command, option, settings_given
from vislam2tag.cli.tables import metres, print_table
from vislam2tag.cli.terminal import answer, say, visible_console
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.settings import CHANGE_CELL_M, SplitKind, SplitSettings

if TYPE_CHECKING:
    from vislam2tag.datasets.changes import TechnologyChanges
    from vislam2tag.datasets.comparison import TableDifferences
    from vislam2tag.datasets.label_comparison import LabelComparison
    from vislam2tag.datasets.leakage import FoldLeakage, QuantileSummary, SplitLeakage


_TAKES: Mapping[SplitKind, tuple[str, ...]] = MappingProxyType(
    {
        SplitKind.RANDOM: ("seed", "share"),
        SplitKind.TRAJECTORY: ("seed", "folds"),
        SplitKind.BLOCK: ("seed", "share", "block_m", "guard_m"),
    }
)


@dataclass(frozen=True, kw_only=True)
class SplitOptions:
    """Arguments and options of ``vislam2tag split``."""

    dataset: Path = argument("Data set.", metavar="DS")
    by: SplitKind | None = option(None, "Make a new split of this kind and save it.")
    name: str | None = option(None, "Name of the new split.  [default: its kind]")
    seed: int | None = setting("split.seed")
    share: float | None = setting("split.share", hidden=True)
    folds: int | None = setting("split.folds", hidden=True)
    block_m: float | None = setting("split.block_m", hidden=True)
    guard_m: float | None = setting("split.guard_m", hidden=True)
    config: ConfigFile = None
    json: AsJson = False


@command
def split_command(given: SplitOptions) -> None:
    """Split a data set into training and test sets, and show how far they leak.

    Lists the splits of the data set: each fold, its size, and the distance in place and time between test and training
    fingerprints. With --by it makes another split and saves it. docs/reference/splits.md describes the kinds.

    Exit code: 0 listed or made, 2 wrong usage, no data set, or the data do not allow the split, 3 there is no split,
    130 interrupted.

    \b
    Examples:
      vislam2tag split fingerprints
      vislam2tag split fingerprints --by block --seed 1 --name blocks
      vislam2tag split fingerprints --json > splits.json
    """
    from vislam2tag.datasets.leakage import leakage

    by, settings = given.by, _settings(given)
    opened = api.open_dataset(given.dataset)
    if by is None:
        if given.name is not None:
            raise UsageError("--name: also pass --by, the kind of the new split")
        shown = opened.splits
    else:
        split = api.split(opened, by, settings, given.name)
        opened = api.add_split(given.dataset, split)
        shown = {split.info.name: split}
    found = leakage(opened, shown)
    answer(found, given.json, lambda: _print_split(found, opened, given), nothing=not found)


def _settings(given: SplitOptions) -> SplitSettings:
    """The settings of a new split; raises UsageError for an option that its kind does not have."""
    wanted = {name: value for name, value in settings_given(given).items() if value is not None}
    for name in wanted:
        if given.by is None:
            raise UsageError(f"{option_of(name)}: also pass --by, the kind of the new split")
        if name.rpartition(".")[2] not in _TAKES.get(given.by, ()):
            raise UsageError(f"{option_of(name)}: does not apply to a split by {given.by}; remove it")
    return settings_of(given.config, wanted).split


def _print_split(found: tuple[SplitLeakage, ...], opened: api.Dataset, given: SplitOptions) -> None:
    if found:
        _print_leakage(found)
    else:
        say("the data set has no split; make one with --by")
    for split in found:
        say(f"{split.name}: {split.verdict}")
    for finding in opened.info.findings if given.by is None else ():
        if finding.kind in ("no_split", "not_in_split"):
            say(f"{finding.kind} {finding.count}: {finding.message}")
    if found:
        next_step("split", dataset=given.dataset, split=found[0].name)
    else:
        none = "split, none" if opened.labelled else "no position"
        next_step(none, page=given.dataset / "report.html", dataset=given.dataset)


def _print_leakage(found: tuple[SplitLeakage, ...]) -> None:
    rows: list[tuple[str, ...] | None] = []
    for split in found:
        folds = (fold for fold in split.folds if fold.of == split.folds[0].of)
        rows += [*((split.name, fold.fold, *_cells(fold)) for fold in folds), None]
    near = ("metres, same floor", "within 1 m", "seconds, same walk or phone", "within 5 s")
    title = "Distance from test fingerprints to the nearest training fingerprint: 5 %, median, 95 %"
    print_table(title, ("split", "fold"), ("training", "test", *near, "test walks in training"), rows)


def _cells(fold: FoldLeakage) -> tuple[str, ...]:
    return (
        str(fold.train),
        str(fold.test),
        _spread(fold.distance_m),
        f"{100 * fold.within_1_m:.0f} %",
        _spread(fold.time_s),
        f"{100 * fold.within_5_s:.0f} %",
        f"{fold.test_walks_training} of {fold.test_walks}",
    )


def _spread(spread: QuantileSummary | None) -> str:
    return "-" if spread is None else f"{spread.p05:.1f}  {spread.p50:.1f}  {spread.p95:.1f}"


SHOWN = 20
"""Number of differing tables printed; --json lists all."""
_COLUMNS_SHOWN = 3


@command
def verify_command(
    *,
    a: Path = argument("The first folder."),
    b: Path = argument("The second folder."),
    tolerance: float = option(
        0.01,
        "Allowed difference of positions in metres, and of other decimal numbers in their unit. Times, whole "
        "numbers and texts must be equal.",
        least=0.0,
    ),
    json: AsJson = False,
) -> None:
    """Compare two data sets or outputs within a tolerance, for example a published set with a rebuilt one.

    A and B are two data sets, two outputs of `process`, or two folders in the published labelled layout (with
    wifi_annotated.csv and sensors_annotated.csv in each session). Rows are matched by scan and access point, by line of
    the raw file, or by time. Two outputs of `process` are also compared walk by walk: distance between positions,
    labelled share, sigma, and error if the truth is known. Nothing is written.

    Exit code: 0 the same, 1 different, 2 wrong usage or nothing to compare, 130 interrupted.

    \b
    Examples:
      vislam2tag verify published rebuilt
      vislam2tag verify out-before out-now --tolerance 0.001 \\
          --json > differences.json
    """
    with session_bar("tables") as bar:
        found = api.verify(a, b, tolerance, bar.reach)
    answer(found, json, lambda: _print_verify(found, a, b), failed=not found.same)


def _print_verify(found: api.Comparison, a: Path, b: Path) -> None:
    for letter, sessions in (("A", found.missing_sessions), ("B", found.extra_sessions)):
        for session in sessions:
            say(f"only {letter} contains session {session}")
    if found.facts:
        say(f"the manifests differ in: {', '.join(found.facts)}")
    if found.differences:
        _print_tables(found.differences[:SHOWN])
    if found.labels and not found.same:
        _print_walks(found.labels)
    if len(found.differences) > SHOWN:
        say(f"{len(found.differences) - SHOWN} more tables differ; --json lists all")
    say(_last_line(found))
    next_step("verify" if found.same else "verify, different", a=a, b=b)


def _print_tables(differences: tuple[TableDifferences, ...]) -> None:
    from vislam2tag.datasets.comparison import WHOLE_SET

    rows = []
    for one in differences:
        session = one.session if one.session != WHOLE_SET else "-"
        rows.append((session, one.table, _texts(one), str(one.matched), str(one.missing), str(one.extra)))
    heads = ("rows in both", "only in A", "only in B")
    print_table("Differences", ("session", "table", "difference"), heads, rows)


def _print_walks(found: LabelComparison) -> None:
    """Print the walks with the largest distance first, the totals, and the settings that differ."""
    rows = []
    for one in sorted(found.sessions, key=lambda one: -(one.apart_p95_m or 0.0))[:SHOWN]:
        pairs = (
            f"{_share(one.labelled_a)}, {_share(one.labelled_b)}",
            f"{metres(one.sigma_a_m)}, {metres(one.sigma_b_m)}",
            f"{metres(one.error_a_m)}, {metres(one.error_b_m)}",
        )
        rows.append((one.id, *pairs, metres(one.apart_median_m), metres(one.apart_p95_m)))
    labelled, sigma, error = ((total.a, total.b) for total in found.totals[1:])
    totals = (", ".join(map(form, pair)) for form, pair in ((_share, labelled), (metres, sigma), (metres, error)))
    heads = ("labelled", "sigma", "error", "distance (median)", "distance (95 %)")
    print_table("Walks, A and B", ("session",), heads, [*rows, ("all", *totals, "", "")])
    for each in found.settings:
        say(f"{each.name}: {each.a}, {each.b}")


def _share(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.1f} %"


def _texts(one: TableDifferences) -> str:
    lines = []
    for letter, names in (("A", one.missing_columns), ("B", one.extra_columns)):
        if names:
            lines.append(f"column only in {letter}, or of another type: {', '.join(names)}")
    for column in one.columns[:_COLUMNS_SHOWN]:
        most = "" if column.greatest is None else f", at most {column.greatest:.4g}"
        lines.append(f"{column.column}: {column.rows} rows{most} (at {column.where})")
    if len(one.columns) > _COLUMNS_SHOWN:
        lines.append(f"and {', '.join(column.column for column in one.columns[_COLUMNS_SHOWN:])}")
    for letter, names in (("A", one.missing_rows), ("B", one.extra_rows)):
        if names:
            lines.append(f"only in {letter}: {names[0]}" + (", ..." if len(names) > 1 else ""))
    return "\n".join(lines)


def _last_line(found: api.Comparison) -> str:
    compared = f"{found.tables} tables with {found.rows} common rows, tolerance {found.tolerance:g}"
    if found.same:
        return f"the same: {compared}"
    sessions = len(found.missing_sessions) + len(found.extra_sessions)
    return f"different: {len(found.differences)} of {compared}; {sessions} sessions on one side only"


@command
def join_command(
    *,
    base: Path = argument("The data set."),
    later: Path = argument("The data set of a later survey of the same building."),
    out: Path = option(..., "Folder for the joined data set: new, empty or an earlier data set."),
    cell_m: float = option(CHANGE_CELL_M, "Side length of the squares that are compared, metres.", least=0.5),
    replace: Replace = False,
    follow_links: FollowLinks = False,
    json: AsJson = False,
) -> None:
    """Add a later survey to a data set and report what changed in the building.

    Writes one data set of all walks to OUT. OUT/changes lists access points that appeared, vanished or moved, judged
    only where both surveys walked. It also lists places whose RSSI changed by more than noise and phone offsets
    explain. Walk these again. docs/how-to/second-survey.md explains the tests. A walk in both data sets is used once.

    Exit code: 0 joined, 2 wrong usage, or the sets cannot be joined, 130 interrupted.

    \b
    Examples:
      vislam2tag join fingerprints-2022 fingerprints-2023 --out fingerprints
      vislam2tag join fingerprints check-walk --out fingerprints-now --cell-m 6
    """
    with outputs_of_interrupted(out), visible_console(stderr=True).status("joining"):
        record = api.join(base, later, out, cell_m, replace=replace, follow_links=follow_links)
    answer(record, json, lambda: _print_join(record, out))


def _print_join(record: api.SurveyChanges, out: Path) -> None:
    from vislam2tag.datasets.changes import CHANGED, OUTDATED
    from vislam2tag.pipeline.datasets.join import CHANGES

    for one in record.technologies:
        if one.changed:
            _print_points(one)
        points = ", ".join(f"{count} {change}" for change, count in one.access_points.items())
        places = ", ".join(f"{count} {change}" for change, count in one.places.items())
        again = one.places.get(CHANGED, 0) + one.places.get(OUTDATED, 0)
        say(f"{one.technology}: access points: {points or 'none'}")
        say(f"{one.technology}: places: {places or 'none'}")
        say(f"{one.technology}: walk {again} places again")
    for finding in record.findings:
        say(f"{finding.kind}: {finding.message}")
    say(f"joined: {out}, changes: {out / CHANGES}")
    next_step("join", dataset=out)


def _print_points(one: TechnologyChanges) -> None:
    rows = []
    for point in one.changed:
        was = _where(point.base_floor, point.base_x, point.base_y)
        now = _where(point.later_floor, point.later_x, point.later_y)
        rows.append((point.bssid, point.ssid or "", point.change, f"{point.difference_db:+.1f}", was, now))
    title = f"Access points that changed ({one.technology})"
    print_table(title, ("bssid", "ssid", "change"), ("dB", "was at", "is at"), rows)


def _where(floor: int | None, x: float | None, y: float | None) -> str:
    return "-" if floor is None else f"floor {floor} ({x:.0f}, {y:.0f})"
