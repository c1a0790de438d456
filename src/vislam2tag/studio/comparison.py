"""Two outputs of the same walks: how far apart they put them, how sure they are, and how right where truth is known."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.labeling.results import SessionResult
from vislam2tag.report.run_page.summary import labelled_share
from vislam2tag.studio.session_view import mean_error_m
from vislam2tag.studio.survey_view import output_view
from vislam2tag.studio.tracks import Track
from vislam2tag.studio.work_messages import ComparedSession, ComparedSetting, ComparedTotal, ComparisonView
from vislam2tag.studio.workspace import Workspace


def comparison(workspace: Workspace, a: str, b: str) -> ComparisonView:
    """Compare two outputs by their names; raises KeyError where there is none of a name."""
    first, second = workspace.outputs[a], workspace.outputs[b]
    pairs = {id: (workspace.result(id, a), workspace.result(id, b)) for id in workspace.now.ids}
    known = {id: pair for id, pair in pairs.items() if pair != (None, None)}
    return ComparisonView(
        a=output_view(first),
        b=output_view(second),
        sessions=[
            _session(id, *pair, _apart_m(workspace.track(id, a), workspace.track(id, b))) for id, pair in known.items()
        ],
        totals=_totals([pair[0] for pair in known.values()], [pair[1] for pair in known.values()]),
        settings=_settings(first.settings(), second.settings()),
    )


def _session(id: str, a: SessionResult | None, b: SessionResult | None, apart_m: FloatArray) -> ComparedSession:
    median, p95 = np.quantile(apart_m, (0.5, 0.95)).tolist() if len(apart_m) else (None, None)
    return ComparedSession(
        id=id,
        labelled_a=labelled_share(a.frames) if a else None,
        labelled_b=labelled_share(b.frames) if b else None,
        sigma_a_m=_sigma_m(a),
        sigma_b_m=_sigma_m(b),
        error_a_m=mean_error_m([a]),
        error_b_m=mean_error_m([b]),
        apart_median_m=median,
        apart_p95_m=p95,
        frames_compared=len(apart_m),
    )


def _apart_m(a: Track | None, b: Track | None) -> FloatArray:
    """Distances between the positions that both give a frame on the same floor; the frames are those of one file."""
    if a is None or b is None or len(a) != len(b):
        return np.empty(0)
    both = a.positioned & b.positioned & (a.columns["floor"] == b.columns["floor"])
    across, up = (a.columns[axis][both].astype(np.float64) - b.columns[axis][both] for axis in ("x", "y"))
    return np.asarray(np.hypot(across, up))


def _totals(a: list[SessionResult | None], b: list[SessionResult | None]) -> list[ComparedTotal]:
    def total(measure: str, values: tuple[float | None, float | None], unit: str) -> ComparedTotal:
        return ComparedTotal(measure=measure, a=values[0], b=values[1], unit=unit)

    return [
        total("sessions", (float(sum(map(bool, a))), float(sum(map(bool, b)))), ""),
        total("labelled", (_labelled(a), _labelled(b)), "share"),
        total("sigma_median", (_typical_sigma_m(a), _typical_sigma_m(b)), "m"),
        total("error_mean", (mean_error_m(a), mean_error_m(b)), "m"),
    ]


def _labelled(results: list[SessionResult | None]) -> float | None:
    return labelled_share(sum((Counter(result.frames) for result in results if result), Counter[str]()))


def _typical_sigma_m(results: list[SessionResult | None]) -> float | None:
    """Median over the sessions of their median sigma."""
    known = [sigma for result in results if (sigma := _sigma_m(result)) is not None]
    return float(np.median(known)) if known else None


def _sigma_m(result: SessionResult | None) -> float | None:
    return result.sigma.median_m if result and result.sigma else None


def _settings(a: Mapping[str, object], b: Mapping[str, object]) -> list[ComparedSetting]:
    first, second = dict(_leaves(a)), dict(_leaves(b))
    return [
        ComparedSetting(name=name, a=first.get(name, ""), b=second.get(name, ""))
        for name in sorted(first.keys() | second.keys())
        if first.get(name) != second.get(name)
    ]


def _leaves(settings: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, str]]:
    for name, value in settings.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{name}.")
        else:
            yield prefix + name, str(value)
