"""``vislam2tag split``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.records import argument, command, option, settings_given
from vislam2tag.cli.settings_options import ConfigFile, option_of, setting, settings_of
from vislam2tag.cli.tables import print_table
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.settings import SplitKind, SplitSettings

if TYPE_CHECKING:
    from vislam2tag.datasets.leakage import FoldLeakage, QuantileSummary, SplitLeakage
    from vislam2tag.datasets.model import Dataset


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
    by: SplitKind | None = option(None, "Make a split that holds this out, and save it.")
    name: str | None = option(None, "Name of the new split; else its kind.")
    seed: int | None = setting("split.seed")
    share: float | None = setting("split.share")
    folds: int | None = setting("split.folds")
    block_m: float | None = setting("split.block_m")
    guard_m: float | None = setting("split.guard_m")
    config: ConfigFile = None
    json: AsJson = False


@command
def split_command(given: SplitOptions) -> None:
    """Splits of a data set into what trains and what tests, and how far each leaks.

    Lists the splits saved with the data set: each fold, its size, and how near in place and time its test fingerprints
    are to those that train. With --by it makes one more and saves it. docs/reference/splits.md tells what each kind
    holds out.

    Exit code: 0 all right, 1 there is no split, 2 wrong usage, no data set, the data cannot give the split, or it
    cannot be written, 130 interrupted.

    \b
    Examples:
      vislam2tag split fingerprints
      vislam2tag split fingerprints --by block --block-m 8 --guard-m 3 \\
          --seed 1 --name blocks-8m
      vislam2tag split fingerprints --json > splits.json
    """
    from vislam2tag.datasets.folder import open_dataset
    from vislam2tag.datasets.leakage import leakage
    from vislam2tag.datasets.splits import make_split
    from vislam2tag.pipeline.datasets.finish import add_split

    by, settings = given.by, _settings(given)
    opened = open_dataset(given.dataset)
    if by is None:
        if given.name is not None:
            raise UsageError("--name: names a new split; say by --by what it holds out")
        shown = opened.splits
    else:
        split = make_split(opened, by, settings, given.name)
        opened = add_split(given.dataset, split)
        shown = {split.info.name: split}
    found = leakage(opened, shown)
    answer(found, given.json, lambda: _print(found, opened, given), failed=not found)


def _settings(given: SplitOptions) -> SplitSettings:
    """Return the settings of a new split; raises UsageError for an option that does not belong to it."""
    wanted = {name: value for name, value in settings_given(given).items() if value is not None}
    for name in wanted:
        if given.by is None:
            raise UsageError(f"{option_of(name)}: belongs to a new split; say by --by what it holds out")
        if name.rpartition(".")[2] not in _TAKES.get(given.by, ()):
            raise UsageError(f"{option_of(name)}: a split by {given.by} takes no such option; leave it out")
    return settings_of(given.config, wanted).split


def _print(found: tuple[SplitLeakage, ...], opened: Dataset, given: SplitOptions) -> None:
    if found:
        _print_leakage(found)
    else:
        say("no splits; --by makes one")
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
    title = "From each test fingerprint to the nearest that trains: 5 %, half, 95 %"
    print_table(title, ("split", "fold"), ("train", "test", *near, "walks that train"), rows)


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
