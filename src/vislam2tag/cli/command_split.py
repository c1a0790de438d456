"""``vislam2tag split``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.settings_options import ConfigFile, option_of, setting, settings_of
from vislam2tag.cli.tables import table, table_console
from vislam2tag.cli.terminal import say, say_json
from vislam2tag.common.errors import UsageError
from vislam2tag.dataset.settings import SplitKind, SplitSettings

if TYPE_CHECKING:
    from vislam2tag.dataset.leakage import FoldLeakage, QuantileSummary, SplitLeakage
    from vislam2tag.dataset.model import Dataset


HELP = """
Splits of a data set into what trains and what tests, and how far each leaks.

Lists the splits saved with the data set: each fold, its size, and how near in place and time its test fingerprints are
to those that train. With --by it makes one more and saves it. docs/reference/splits.md tells what each kind holds
out.

Exit code: 0 all right, 1 there is no split, 2 wrong usage, no data set, the data cannot give the split, or it cannot be
written, 130 interrupted.

\b
Examples:
  vislam2tag split fingerprints
  vislam2tag split fingerprints --by block --block-m 8 --guard-m 3 \\
      --seed 1 --name blocks-8m
  vislam2tag split fingerprints --json > splits.json
"""
_TAKES: Mapping[SplitKind, tuple[str, ...]] = MappingProxyType(
    {
        SplitKind.RANDOM: ("seed", "share"),
        SplitKind.TRAJECTORY: ("seed", "folds"),
        SplitKind.BLOCK: ("seed", "share", "block_m", "guard_m"),
    }
)


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("split", help=HELP)(_split)


def _split(
    dataset: Annotated[Path, typer.Argument(metavar="DS", help="Data set.")],
    by: Annotated[SplitKind | None, typer.Option(help="Make a split that holds this out, and save it.")] = None,
    name: Annotated[str | None, typer.Option(help="Name of the new split; else its kind.")] = None,
    seed: Annotated[int | None, setting("split.seed")] = None,
    share: Annotated[float | None, setting("split.share")] = None,
    folds: Annotated[int | None, setting("split.folds")] = None,
    block_m: Annotated[float | None, setting("split.block_m")] = None,
    guard_m: Annotated[float | None, setting("split.guard_m")] = None,
    config: ConfigFile = None,
    json: AsJson = False,
) -> None:
    from vislam2tag.dataset.folder import open_dataset
    from vislam2tag.dataset.leakage import leakage
    from vislam2tag.dataset.splits import make_split
    from vislam2tag.pipeline.datasets.finish import add_split

    given = {"seed": seed, "share": share, "folds": folds, "block_m": block_m, "guard_m": guard_m}
    settings = _settings(by, config, {f"split.{key}": value for key, value in given.items() if value is not None})
    opened = open_dataset(dataset)
    if by is None:
        if name is not None:
            raise UsageError("--name: names a new split; say by --by what it holds out")
        shown = opened.splits
    else:
        split = make_split(opened, by, settings, name)
        opened = add_split(dataset, split)
        shown = {split.info.name: split}
    found = leakage(opened, shown)
    if json:
        say_json(found)
    else:
        _print(found, opened if by is None else None)
        _tell_next(found, opened, dataset)
    raise typer.Exit(0 if found else 1)


def _tell_next(found: tuple[SplitLeakage, ...], opened: Dataset, folder: Path) -> None:
    """Go on with the first split, or with what makes one."""
    if found:
        next_step("split", dataset=folder, split=found[0].name)
    else:
        next_step("split, none" if opened.labelled else "no position", page=folder / "report.html")


def _settings(by: SplitKind | None, config: Path | None, given: Mapping[str, float]) -> SplitSettings:
    """Return the settings of a new split; raises UsageError for an option that does not belong to it."""
    for name in given:
        if by is None:
            raise UsageError(f"{option_of(name)}: belongs to a new split; say by --by what it holds out")
        if name.rpartition(".")[2] not in _TAKES.get(by, ()):
            raise UsageError(f"{option_of(name)}: a split by {by} takes no such option; leave it out")
    return settings_of(config, given).split


def _print(found: tuple[SplitLeakage, ...], listed: Dataset | None) -> None:
    from rich.markup import escape

    rows = table(
        "From each test fingerprint to the nearest that trains: 5 %, half, 95 %",
        ("split", "fold"),
        (
            "train",
            "test",
            "metres, same floor",
            "within 1 m",
            "seconds, same walk or phone",
            "within 5 s",
            "walks that train",
        ),
    )
    for split in found:
        for fold in split.folds:
            if fold.of == split.folds[0].of:
                rows.add_row(escape(split.name), escape(fold.fold), *_cells(fold))
        rows.add_section()
    if found:
        table_console().print(rows)
    else:
        say("no splits; --by makes one")
    for split in found:
        say(f"{split.name}: {split.verdict}")
    for finding in listed.info.findings if listed is not None else ():
        if finding.kind in ("no_split", "not_in_split"):
            say(f"{finding.kind} {finding.count}: {finding.message}")


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
