"""Splits of a data set into training set and test set, one function for each kind (docs/reference/splits.md).

Every fingerprint and window is assigned to a group, so that one split serves all; unlabelled ones are in neither part.
A split that is impossible with the data (only one phone, no dates) raises UsageError with the reason.
"""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Finding, FindingKind, Severity
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Status
from vislam2tag.datasets.model import TEST, TRAIN, Dataset, Fold, Split, SplitInfo
from vislam2tag.datasets.schema import FINGERPRINTS, IMU_WINDOWS, MAGNETIC, SESSIONS
from vislam2tag.datasets.settings import SplitKind, SplitSettings

IMU = "imu"
_RANKS = {"wifi": 0, MAGNETIC: 2, IMU: 3}
_OTHER_RADIO = 1
COLUMNS = ("id", "kind", "building", "floor", "x", "y", "device", "session", "date", "time_ns", "labelled")


def split_items(dataset: Dataset) -> pl.DataFrame:
    """One row for each fingerprint, magnetic fingerprint and IMU window, in no particular order.

    The columns are those of :data:`COLUMNS`. ``kind`` is the technology, ``magnetic`` or ``imu``. ``x``, ``y`` are in
    metres, BCS; those of an IMU window are the middle of its ends. ``time_ns`` is the middle of a fingerprint, or the
    start of a window. ``labelled`` means that floor and position are known, and that a fingerprint's status is ``ok``.
    """
    day = pl.col("started").dt.date()
    dates = dataset.tables[SESSIONS].select("session", date=day).unique("session", keep="any")
    parts = [_fingerprints(dataset.tables[FINGERPRINTS])]
    if MAGNETIC in dataset.tables:
        magnetic = dataset.tables[MAGNETIC].with_columns(kind=pl.lit(MAGNETIC), time_ns=_middle_ns())
        parts.append(_windows(magnetic, dates))
    if IMU_WINDOWS in dataset.tables:
        x, y = ((pl.col(f"{axis}_start") + pl.col(f"{axis}_end")) / 2 for axis in "xy")
        imu = dataset.tables[IMU_WINDOWS].with_columns(x=x, y=y, kind=pl.lit(IMU), time_ns="start_ns")
        parts.append(_windows(imu, dates))
    return pl.concat(parts).with_columns(pl.col("building").fill_null("")).collect()


def rank_of_kind() -> pl.Expr:
    """Order of kinds: Wi-Fi, other radio technologies, magnetic fingerprints, IMU windows."""
    return pl.col("kind").replace_strict(_RANKS, default=_OTHER_RADIO, return_dtype=pl.Int8)


def kind_order(kinds: pl.Series) -> list[str]:
    """Return the existing kinds, in this order."""
    return sorted(kinds.unique(), key=lambda kind: (_RANKS.get(kind, _OTHER_RADIO), kind))


def _fingerprints(table: pl.LazyFrame) -> pl.LazyFrame:
    sure = (pl.col("status") == Status.OK.label).fill_null(False)
    renamed = table.with_columns(id="scan_id", kind="technology", time_ns=_middle_ns(), labelled=_known() & sure)
    return renamed.select(COLUMNS)


def _windows(table: pl.LazyFrame, dates: pl.LazyFrame) -> pl.LazyFrame:
    """Windows have the date on which their walk started."""
    named = table.with_columns(id="window_id", labelled=_known())
    return named.join(dates, on="session", how="left").select(COLUMNS)


def _known() -> pl.Expr:
    return pl.all_horizontal(pl.col("floor", "x", "y").is_not_null())


def _middle_ns() -> pl.Expr:
    """Middle of start and end; the start if the end is unknown."""
    return pl.col("start_ns") + (pl.col("end_ns").fill_null(pl.col("start_ns")) - pl.col("start_ns")) // 2


_KEY = ("building", "floor", "column", "line")
_LABELLED = pl.col("labelled")
_GROUP = pl.col("group")
_PLACE = ("building", "floor")


def standard_splits(dataset: Dataset, seed: int = 0) -> dict[str, Split]:
    """Make every kind of split that is possible with the data, with the default settings; by name of the kind."""
    items = split_items(dataset)
    made = (_made_or_reason(items, kind, SplitSettings(seed=seed)) for kind in SplitKind)
    return {split.info.name: split for split in made if isinstance(split, Split)}


def split_findings(dataset: Dataset) -> tuple[Finding, ...]:
    """Report the kinds that :func:`standard_splits` skipped, with reasons, and labels that are in no part of others."""
    items = split_items(dataset)
    findings = []
    for kind in SplitKind:
        made = _made_or_reason(items, kind, SplitSettings())
        if not isinstance(made, Split):
            findings.append(
                _finding("no_split", items.height, f"split {made.removeprefix('--')}; it is skipped", Severity.INFO)
            )
            continue
        known = items.filter(_LABELLED)["id"].implode()
        outside = made.groups.filter(pl.col("id").is_in(known), _GROUP.is_null()).height
        if outside:
            message = f"split by {kind}: labelled fingerprints and windows without a {kind} are in neither part"
            findings.append(_finding("not_in_split", outside, message, Severity.WARNING))
    return tuple(findings)


def make_split(dataset: Dataset, kind: SplitKind, settings: SplitSettings, name: str | None = None) -> Split:
    """Make one split; ``name`` defaults to that of the kind. Raises UsageError if it is impossible with the data."""
    return _KINDS[kind](split_items(dataset), settings, kind.value if name is None else name)


def random_split(items: pl.DataFrame, settings: SplitSettings, name: str) -> Split:
    """Draw a share of the fingerprints of each building, floor and device (paper, section VII-A).

    Wi-Fi fingerprints are drawn (in a walk without any: BLE, else magnetic, else IMU windows). All other rows of the
    walk follow the drawn one that is closest in time, so that no moment of a walk is in both parts.
    """
    labelled = items.filter(_LABELLED).with_columns(rank=rank_of_kind())
    placed = pl.all_horizontal(pl.col("time_ns", "session").is_not_null())
    first = pl.col("rank") == pl.col("rank").filter(placed).min().over("session")
    leads = labelled.filter(first | ~placed)
    tests = stratified_sample(leads, "id", (*_PLACE, "device", "kind"), settings.share, settings.seed)
    leads = leads.with_columns(group=pl.when(tests).then(pl.lit(TEST)).otherwise(pl.lit(TRAIN)))
    follow = labelled.join(leads, on="id", how="anti")
    groups = pl.concat([leads.select("id", "group"), _followed(follow, leads)])
    return _split(
        items,
        groups,
        SplitInfo(
            name=name,
            kind=SplitKind.RANDOM,
            parameters={"share": settings.share, "seed": settings.seed},
            folds=(Fold(name=TEST, test=(TEST,)),),
        ),
        f"too few fingerprints on each floor and device to draw {100 * settings.share:g} %",
    )


def each_held_out(items: pl.DataFrame, settings: SplitSettings, name: str, kind: SplitKind) -> Split:
    """Use each device, day or floor (of each building) as the test set in turn."""
    del settings
    day = pl.col("date").dt.to_string("iso")
    key = {SplitKind.DEVICE: pl.col("device"), SplitKind.DAY: day, SplitKind.FLOOR: _floor_name()}[kind]
    groups = items.filter(_LABELLED).select("id", group=key)
    values = groups["group"].drop_nulls().unique().sort()
    folds = tuple(Fold(name=value, test=(value,)) for value in values)
    info = SplitInfo(name=name, kind=kind, folds=folds)
    what = "is only one" if len(values) else "is no"
    return _split(items, groups, info, f"there {what} {kind}")


def trajectory_split(items: pl.DataFrame, settings: SplitSettings, name: str) -> Split:
    """Deal whole walks to folds, floor after floor in random order; each fold is the test set once."""
    labelled = items.filter(_LABELLED, pl.col("session").is_not_null())
    walks = labelled.group_by("session").agg(pl.col("building", "floor").min())
    count = min(settings.folds, walks.height)
    hands = stratified_folds(walks, "session", _PLACE, max(count, 1), settings.seed)
    folds = tuple(
        Fold(name=f"{TEST}_{hand + 1}", test=tuple(walks.filter(hands == hand)["session"].sort()))
        for hand in range(count)
    )
    parameters: dict[str, float | int | str] = {"folds": count, "seed": settings.seed}
    info = SplitInfo(name=name, kind=SplitKind.TRAJECTORY, parameters=parameters, folds=folds)
    return _split(items, labelled.select("id", group="session"), info, "there is only one walk, or walks have no names")


def block_split(items: pl.DataFrame, settings: SplitSettings, name: str) -> Split:
    """Use a share of each floor's square blocks as the test set; the guard ring around them is in neither part.

    A block is ``x // side, y // side``; only blocks with fingerprints are drawn. Floors are drawn independently. Raises
    UsageError if the ring is many blocks wide.
    """
    if settings.guard_m > _WIDEST_GUARD * settings.block_m:
        raise UsageError(
            f"a guard of {settings.guard_m:g} m is wider than {_WIDEST_GUARD} blocks of "
            f"{settings.block_m:g} m; choose larger blocks or a smaller guard"
        )
    labelled = block_of(items.filter(_LABELLED), settings.block_m)
    labelled = labelled.with_columns(group=_floor_name() + pl.format(" block {} {}", "column", "line"))
    blocks = labelled.select(*_PLACE, "column", "line", "group").unique().sort("group")
    tests = blocks.filter(stratified_sample(blocks, "group", _PLACE, settings.share, settings.seed))
    outside = ~labelled["group"].is_in(tests["group"].implode())
    guard = outside & near_blocks(labelled, tests, settings.block_m, settings.guard_m)
    groups = labelled.select("id", group=pl.when(~guard).then(_GROUP))
    parameters: dict[str, float | int | str] = {
        "block_m": settings.block_m,
        "guard_m": settings.guard_m,
        "share": settings.share,
        "seed": settings.seed,
    }
    folds = (Fold(name=TEST, test=tuple(tests["group"])),)
    info = SplitInfo(name=name, kind=SplitKind.BLOCK, parameters=parameters, folds=folds)
    return _split(items, groups, info, f"too few blocks of {settings.block_m:g} m to draw a test set")


_WIDEST_GUARD = 20
"""Widest guard in blocks; a wider ring leaves almost nothing for training."""
_KINDS: Mapping[SplitKind, Callable[[pl.DataFrame, SplitSettings, str], Split]] = MappingProxyType(
    {
        SplitKind.RANDOM: random_split,
        SplitKind.TRAJECTORY: trajectory_split,
        SplitKind.BLOCK: block_split,
        **{kind: partial(each_held_out, kind=kind) for kind in (SplitKind.DEVICE, SplitKind.DAY, SplitKind.FLOOR)},
    }
)


def _made_or_reason(items: pl.DataFrame, kind: SplitKind, settings: SplitSettings) -> Split | str:
    try:
        return _KINDS[kind](items, settings, kind.value)
    except UsageError as error:
        return str(error)


def _split(items: pl.DataFrame, groups: pl.DataFrame, info: SplitInfo, otherwise: str) -> Split:
    """Give each item its group, in order of the ids; raises UsageError if a part of the split is empty."""
    whole = items.select("id").join(groups, on="id", how="left").sort("id")
    present = whole["group"].drop_nulls().unique()
    tested = {group for fold in info.folds for group in fold.test}
    if len(present) < 2 or not tested.intersection(present):
        raise UsageError(f"--by {info.kind}: {otherwise}")
    return Split(info, whole)


def _followed(follow: pl.DataFrame, leads: pl.DataFrame) -> pl.DataFrame:
    """Give rows the group of the row among ``leads`` of their walk that is closest in time."""
    timed = leads.select("session", "time_ns", "group", by="id").drop_nulls("time_ns").sort("time_ns", "by")
    found = follow.sort("time_ns", "id").join_asof(
        timed, on="time_ns", by="session", strategy="nearest", check_sortedness=False
    )
    return found.select("id", "group")


def _floor_name() -> pl.Expr:
    building = pl.when(pl.col("building") != "").then(pl.col("building") + " ").otherwise(pl.lit(""))
    return building + pl.format("floor {}", "floor")


def _finding(kind: FindingKind, count: int, message: str, severity: Severity) -> Finding:
    return Finding(kind=kind, file=FINGERPRINTS, count=count, message=message, severity=severity)


def draw_order(names: pl.Series, seed: int) -> pl.Series:
    """Give each name its SHA-256 (hexadecimal) under a seed, for sorting in random order."""
    return pl.Series("draw", [hashlib.sha256(f"{seed}/{name}".encode()).hexdigest() for name in names], dtype=pl.String)


def stratified_sample(table: pl.DataFrame, name: str, strata: tuple[str, ...], share: float, seed: int) -> pl.Series:
    """Draw a share of the rows of each stratum, by the unique names in column ``name``; return a mask (n,).

    Draws exactly ``round(share * rows)`` of each stratum (halves up). An additional row changes the part of at most one
    other row in its stratum, and of none outside.
    """
    place = pl.col("draw").rank("ordinal").over(strata)
    wanted = (pl.len().over(strata) * share + 0.5).floor()
    return table.with_columns(draw_order(table[name], seed)).select(drawn=place <= wanted)["drawn"]


def stratified_folds(table: pl.DataFrame, name: str, strata: tuple[str, ...], hands: int, seed: int) -> pl.Series:
    """Deal the rows to hands 0 to ``hands - 1``, stratum after stratum, as evenly as possible: (n,)."""
    ordered = table.with_row_index("row").with_columns(draw_order(table[name], seed)).sort(*strata, "draw")
    return ordered.with_columns(hand=pl.int_range(pl.len()) % hands).sort("row")["hand"]


def block_of(items: pl.DataFrame, side_m: float) -> pl.DataFrame:
    """Add the block of each ``x``, ``y`` (m, BCS): its ``column`` along x and ``line`` along y, from the origin."""
    return items.with_columns(
        column=(pl.col("x") / side_m).floor().cast(pl.Int64), line=(pl.col("y") / side_m).floor().cast(pl.Int64)
    )


def near_blocks(items: pl.DataFrame, blocks: pl.DataFrame, side_m: float, guard_m: float) -> pl.Series:
    """Return which items (n,), of :func:`block_of`, are closer than ``guard_m`` to one of the blocks of their floor."""
    near = np.zeros(items.height, dtype=bool)
    if guard_m > 0:
        reach = math.ceil(guard_m / side_m)
        known = blocks.select(_KEY).with_columns(known=pl.lit(True))
        for column, line in itertools.product(range(-reach, reach + 1), repeat=2):
            beside = items.with_columns(pl.col("column") + column, pl.col("line") + line)
            found = beside.join(known, on=_KEY, how="left", maintain_order="left", nulls_equal=True)["known"]
            near |= found.fill_null(False).to_numpy() & (_distance_m(beside, side_m) < guard_m)
    return pl.Series("near", near)


def _distance_m(items: pl.DataFrame, side_m: float) -> FloatArray:
    """Distance (n,) from each item to the block in its row."""
    low, place = items.select("column", "line").to_numpy() * side_m, items.select("x", "y").to_numpy()
    distance: FloatArray = np.hypot(*np.maximum(np.maximum(low - place, place - low - side_m), 0.0).T)
    return distance
