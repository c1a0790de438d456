"""Results of a benchmark: the recommended models, tables as text, and the paper's Table IV.

A recommendation names its reasons and the interval of the runner-up's additional error. CSV has one figure in each
field; LaTeX needs booktabs. Table IV: floors and errors with a random 30 % as test set, then with each device.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
import polars as pl

from vislam2tag.common.error_statistics import mean_interval
from vislam2tag.common.records import Record
from vislam2tag.common.text_tables import csv_rows, latex_escaped, latex_table, markdown_table
from vislam2tag.positioning.benchmark import ALL, FIGURES, SHARES, BenchmarkRow, BestModel, RunRecord, RunTime
from vislam2tag.quality.evaluation.record import FigureWithInterval

COMPLETE = 0.9
"""A model that answers less than this share of the scans of the most complete one is not recommended ..."""
FLOORS_OFF = 0.05
"""... nor one with a floor hit rate this much below the best (shares 0 to 1)."""
REFERENCE = "weighted-knn"
"""Model for relative times."""
_DIGITS = 6
"""Digits of intervals, in metres."""
Behind = Callable[[str, str, str], tuple[float, float] | None]
"""From a split, its best model and the runner-up to the 95 % interval of the runner-up's additional error, metres."""


def _unknown(split: str, model: str, runner_up: str) -> None:
    del split, model, runner_up


def best_models(rows: Sequence[BenchmarkRow], behind: Behind = _unknown) -> list[BestModel]:
    """The best model of each split, over all its folds; splits without any error are skipped."""
    splits = dict.fromkeys(row.split for row in rows)
    found = (_best(split, [row for row in rows if row.split == split], behind) for split in splits)
    return [one for one in found if one is not None]


def _best(split: str, rows: Sequence[BenchmarkRow], behind: Behind) -> BestModel | None:
    whole = [row for row in rows if row.fold == ALL] or rows
    answered, floors = (_greatest(whole, name) for name in ("answered", "floor_hit"))
    fit = {
        row.model: row.figures["mean_m"].value
        for row in whole
        if _of(row, "answered") >= COMPLETE * answered and _of(row, "floor_hit") >= floors - FLOORS_OFF
    }
    ranked = sorted((mean, model) for model, mean in fit.items() if mean is not None)
    if not ranked:
        return None
    (mean_m, model), *others = ranked
    floor_hit = next(row.figures["floor_hit"].value for row in whole if row.model == model)
    runner_up, behind_m = (others[0][1], others[0][0] - mean_m) if others else (None, 0.0)
    return BestModel(
        split=split,
        model=model,
        mean_m=mean_m,
        floor_hit=floor_hit,
        runner_up=runner_up,
        behind_m=behind_m,
        behind_interval_m=None if runner_up is None else behind(split, model, runner_up),
    )


def paired_interval(one: pl.DataFrame, other: pl.DataFrame) -> tuple[float, float] | None:
    """Return the 95 % interval of the additional error of ``other``, by bootstrap over walks; None for few walks.

    Both have columns fold, scan_id, walk and error_m (null: not answered), one row for each seed. Scans that both
    answered count, and each fold has the same weight.
    """
    keys = ("fold", "scan_id", "walk")
    means = [table.group_by(keys).agg(pl.col("error_m").mean()) for table in (one, other)]
    both = means[0].join(means[1], on=keys, suffix="_other", nulls_equal=True).drop_nulls(["error_m", "error_m_other"])
    both = both.with_columns(weight=1 / pl.len().over("fold")).sort("fold", "scan_id")
    walk = both["walk"].fill_null("").to_numpy().astype(np.str_)
    found = mean_interval((both["error_m_other"] - both["error_m"]).to_numpy(), walk, both["weight"].to_numpy())
    return found and (round(found[0], _DIGITS), round(found[1], _DIGITS))


def _greatest(rows: Sequence[BenchmarkRow], name: str) -> float:
    return max((_of(row, name) for row in rows), default=0.0)


def _of(row: BenchmarkRow, name: str) -> float:
    return row.figures[name].value or 0.0


HEADS = {
    "floor_hit": "floor hit",
    "mean_m": "mean",
    "median_m": "median",
    "p75_m": "p75",
    "p95_m": "p95",
    "on_floor_mean_m": "mean, right floor",
    "on_floor_median_m": "median, right floor",
    "space_mean_m": "mean in space",
    "ipin_m": "IPIN score",
    "inside_68": "in 68 %",
    "inside_95": "in 95 %",
}
"""Names of the figures in tables for reading; CSV has all figures."""
_WITH_INTERVAL = {"floor_hit", "mean_m"}


def rows_csv(rows: Sequence[BenchmarkRow]) -> str:
    """One line for each row; each figure with its bounds in ``..._low`` and ``..._high``, empty if unknown."""
    keys = ("split", "fold", "model", "runs", "test_scans")
    head = (*keys, *(f"{name}{end}" for name in FIGURES for end in ("", "_low", "_high")))
    return csv_rows((head, *((*(getattr(row, key) for key in keys), *_bounds(row)) for row in rows)))


def _bounds(row: BenchmarkRow) -> list[float | None]:
    figures = [row.figures[name] for name in FIGURES]
    return [value for figure in figures for value in (figure.value, figure.low, figure.high)]


class ModelTime(Record):
    """Duration of a model, on average over runs, and as a multiple of the reference's in the same benchmark."""

    model: str
    fit_s: float
    predict_ms: float
    """For one scan."""
    fit_ratio: float | None
    """None without a run of the reference."""
    predict_ratio: float | None


def model_times(runs: Sequence[tuple[RunRecord, RunTime]]) -> list[ModelTime]:
    """Mean times by model, and their ratios to those of :data:`REFERENCE` if it was run."""
    fit_s, predict_ms = {}, {}
    for name in dict.fromkeys(run.model for run, _ in runs):
        own = [(run, time) for run, time in runs if run.model == name]
        fit_s[name] = float(np.mean([time.fit_s for _, time in own]))
        predict_ms[name] = 1000 * sum(time.predict_s for _, time in own) / sum(run.score.scans for run, _ in own)
    return [
        ModelTime(
            model=name,
            fit_s=fit_s[name],
            predict_ms=predict_ms[name],
            fit_ratio=_ratio(fit_s[name], fit_s.get(REFERENCE)),
            predict_ratio=_ratio(predict_ms[name], predict_ms.get(REFERENCE)),
        )
        for name in fit_s
    ]


def _ratio(own: float, reference: float | None) -> float | None:
    return own / reference if reference else None


def times_csv(times: Sequence[ModelTime]) -> str:
    """One line for each model: seconds to train, milliseconds to predict a scan, both as multiples of the
    reference's."""
    names = tuple(ModelTime.model_fields)
    return csv_rows((names, *([_rounded(getattr(time, name)) for name in names] for time in times)))


def _rounded(value: str | float | None) -> str | float | None:
    return float(f"{value:.4g}") if isinstance(value, float) else value


def latex_text(rows: Sequence[BenchmarkRow]) -> str:
    """A ``tabular`` (package booktabs) for each split: metres, and shares in percent."""
    return "\n".join(_tabular(split, list(group)) for split, group in groupby(rows, key=lambda row: row.split))


def _tabular(split: str, rows: Sequence[BenchmarkRow]) -> str:
    heads = ("Test", "Model", *map(_percent, HEADS.values()))
    groups = groupby(rows, key=lambda row: row.fold)
    title = f"Split {split}; metres; 95 % intervals over seeds in brackets"
    return latex_table(title, (heads,), (map(_latex_row, group) for _, group in groups), texts=2)


def _latex_row(row: BenchmarkRow) -> tuple[str, ...]:
    figures = (_percent(figure_text(name, row.figures[name])).replace(" to ", ", ") for name in HEADS)
    return (latex_escaped(fold_name(row.fold)), latex_escaped(row.model), *figures)


def _percent(text: str) -> str:
    return text.replace(" %", "\\,\\%")


def fold_name(fold: str) -> str:
    """Name of a fold in tables."""
    return "mean of folds" if fold == ALL else fold


def figure_text(name: str, figure: FigureWithInterval) -> str:
    """Write ``6.53 [6.31 to 6.75]`` or ``94.6 %``; a dash if unknown; intervals only for the main figures."""
    if figure.value is None:
        return "-"
    share = name in SHARES
    text = _number(figure.value, share=share)
    if figure.low is not None and figure.high is not None and name in _WITH_INTERVAL:
        text += f" [{_number(figure.low, share=share)} to {_number(figure.high, share=share)}]"
    return f"{text} %" if share else text


def _number(value: float, *, share: bool) -> str:
    return f"{100 * value:.1f}" if share else f"{value:.2f}"


TABLE_4_TITLE = "Table IV: positioning by test data"
RANDOM, DEVICE = "random", "device"
TABLE_4_SPLITS = (RANDOM, DEVICE)
TABLE_4_HEADS = ("floor hit", "mean / m", "median / m")
_COLUMNS = ("floor_hit", "mean_m", "median_m")
_RANDOM_NAME = "random 30 %"
PAPER: Mapping[tuple[str, str], tuple[float, float, float]] = {
    (_RANDOM_NAME, "multi-cel"): (0.992, 2.08, 1.52),
    (_RANDOM_NAME, "regression-net"): (0.988, 2.59, 2.12),
    ("Galaxy", "multi-cel"): (0.987, 2.68, 2.02),
    ("Galaxy", "regression-net"): (0.979, 3.36, 2.53),
    ("LG", "multi-cel"): (0.992, 2.59, 1.71),
    ("LG", "regression-net"): (0.967, 2.93, 1.94),
    ("OnePlus", "multi-cel"): (0.968, 3.06, 1.76),
    ("OnePlus", "regression-net"): (0.981, 3.80, 2.82),
    ("S20", "multi-cel"): (0.999, 2.05, 1.74),
    ("S20", "regression-net"): (0.993, 2.84, 2.37),
}
"""Share on the right floor, mean and median error in the plane (metres) of giaIndoorLoc, by test data and model."""


@dataclass(frozen=True)
class Table4Row:
    """One model on one set; each figure is ours (the mean over seeds), then the paper's."""

    test: str
    model: str
    here: tuple[float | None, ...]
    paper: tuple[float | None, ...]

    def cells(self) -> tuple[str, ...]:
        """Figures as text in the order of :data:`TABLE_4_HEADS`, each followed by the paper's; a dash for none."""
        pairs = zip(self.here, self.paper, strict=True)
        return tuple(_shown(value, column) for column, pair in enumerate(pairs) for value in pair)


@dataclass(frozen=True)
class Table4:
    """Rows by test data, then model."""

    rows: tuple[Table4Row, ...]

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads of the columns after test data and model."""
        return tuple(head for own in TABLE_4_HEADS for head in (own, "paper"))

    def texts(self) -> dict[str, str]:
        """The table as ``csv``, ``tex`` (package booktabs) and ``md``."""
        return {"csv": self._csv(), "tex": self._latex(), "md": self._markdown()}

    def _csv(self) -> str:
        rows = [("test", "model", *_COLUMNS, *(f"paper_{name}" for name in _COLUMNS))]
        for row in self.rows:
            numbers = ("" if value is None else f"{value:.10g}" for value in (*row.here, *row.paper))
            rows.append((row.test, row.model, *numbers))
        return csv_rows(rows)

    def _markdown(self) -> str:
        rows = ((row.test, row.model, *row.cells()) for row in self.rows)
        return markdown_table(TABLE_4_TITLE, ("test data", "model", *self.heads), rows, texts=2)

    def _latex(self) -> str:
        groups = (
            [(latex_escaped(row.test), latex_escaped(row.model), *row.cells()) for row in group]
            for _, group in groupby(self.rows, key=lambda row: row.test)
        )
        return latex_table(TABLE_4_TITLE, (("Test data", "Model", *self.heads),), groups, texts=2)


def table_4(rows: Sequence[BenchmarkRow]) -> Table4:
    """Select the rows of the paper's splits; models and devices that are not in the paper have no numbers of it."""
    chosen = [row for row in rows if row.split in TABLE_4_SPLITS and row.fold != ALL]
    return Table4(tuple(_row(row) for row in sorted(chosen, key=lambda row: TABLE_4_SPLITS.index(row.split))))


def _row(row: BenchmarkRow) -> Table4Row:
    test = _RANDOM_NAME if row.split == RANDOM else row.fold
    here = tuple(row.figures[name].value for name in _COLUMNS)
    return Table4Row(test, row.model, here, PAPER.get((test, row.model), (None,) * len(_COLUMNS)))


def _shown(value: float | None, column: int) -> str:
    if value is None:
        return "-"
    return f"{value:.3f}" if column == 0 else f"{value:.2f}"
