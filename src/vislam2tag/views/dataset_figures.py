"""A data set in print: fingerprints by device and floor and over time, what they hear, how sure they are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate

import numpy as np
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter, date2num
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from vislam2tag.common import log_bins
from vislam2tag.datasets.coverage import coverage, gap_walks
from vislam2tag.datasets.model import Dataset, Storey
from vislam2tag.datasets.settings import CoverageSettings
from vislam2tag.datasets.statistics_record import (
    DatasetStatistics,
    DeviceRssi,
    Distribution,
    FloorLabels,
    LabelCounts,
    SessionStatistics,
    SigmaDistribution,
    TechnologyStatistics,
)
from vislam2tag.views.coverage_figures import CoveredFloor, coverage_map
from vislam2tag.views.panels import (
    COLUMN_IN,
    PAGE_IN,
    QUIET,
    legend_below,
    letter,
    log_metres,
    panel_grid,
    print_quality,
)

BLUE, ORANGE = "#0072b2", "#e69f00"
PALETTE = (BLUE, ORANGE, "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442")
"""Okabe and Ito's."""
_LABEL_SHARE = 0.15
"""Room above the highest bar for a label, of its height."""
BINS = 60
"""Bars of a histogram at most."""
_THICK = 0.72
"""Thickness of a bar, in rows."""
_ROW_IN = 0.17
"""Height of a bar and the gap to the next, inches."""


def colours_of(devices: Sequence[str]) -> dict[str, str]:
    """A colour for each device; one colour for all where they are more than the palette has."""
    return {device: PALETTE[n] if len(devices) <= len(PALETTE) else BLUE for n, device in enumerate(devices)}


@print_quality
def fingerprints_by_device_and_floor(technology: TechnologyStatistics) -> Figure:
    """Draw how many fingerprints each device and each floor has (paper, Figure 8); unlabelled ones are pale."""
    devices = sorted(technology.by_device, key=lambda name: technology.by_device[name].fingerprints)
    rows = max(len(devices), len(technology.by_floor))
    figure = Figure(figsize=(PAGE_IN, 0.75 + _ROW_IN * max(3, rows)), layout="constrained")
    left, right = figure.subplots(1, 2)
    colours = colours_of(sorted(technology.by_device))
    for row, device in enumerate(devices):
        labels = technology.by_device[device]
        _bar(left, (row, _THICK * len(devices) / max(3, rows)), labels, [(device, labels.labelled)], colours)
    left.set_yticks(range(len(devices)), devices)
    for row, floor in enumerate(technology.by_floor):
        by_device = [(device, labels.labelled) for device, labels in sorted(floor.by_device.items())]
        shown = by_device if len(colours) <= len(PALETTE) else [("", floor.labels.labelled)]
        _bar(right, (row, _THICK * len(technology.by_floor) / max(3, rows)), floor.labels, shown, colours)
    right.set_yticks(range(len(technology.by_floor)), [floor_name(floor) for floor in technology.by_floor])
    for axes, bars in ((left, devices), (right, technology.by_floor)):
        axes.set_ylim(-0.6, len(bars) - 0.4)
        _counts_along(axes)
    letter((left, right), ("Fingerprints per device", "Fingerprints per floor"))
    return figure


def _bar(
    axes: Axes,
    row_and_height: tuple[int, float],
    labels: LabelCounts,
    labelled: Sequence[tuple[str, int]],
    colours: Mapping[str, str],
) -> None:
    """Draw one bar: the labelled fingerprints of each device, the rest, and the number of all labelled at its end."""
    row, height = row_and_height
    start = 0
    for device, count in labelled:
        axes.barh(row, count, left=start, height=height, color=colours.get(device, BLUE), linewidth=0)
        start += count
    axes.barh(row, labels.fingerprints - start, left=start, height=height, color=QUIET, alpha=0.3, linewidth=0)
    axes.annotate(f"{labels.labelled}", (labels.fingerprints, row), (3, 0), textcoords="offset points", va="center")


def _counts_along(axes: Axes) -> None:
    """Whole numbers along the bars, with room for the number at the end of the longest."""
    axes.set_xlim(0, 1.13 * max(axes.get_xlim()[1] / 1.05, 1))
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x", linewidth=0.3, alpha=0.6)
    axes.set_axisbelow(True)


def floor_name(floor: FloorLabels) -> str:
    """Building and number, as far as they are known."""
    number = "no floor" if floor.floor is None else f"floor {floor.floor}"
    return f"{floor.building}, {number}" if floor.building else number


@print_quality
def access_points_heard(heard: Distribution) -> Figure:
    """Draw how many access points a fingerprint holds."""
    figure, (axes,) = panel_grid(1, 1, COLUMN_IN, 0.55)
    width, bins = heard.binned(BINS)
    lowest = np.array(list(bins)) - 0.5
    axes.bar(lowest, list(bins.values()), 0.9 * width, color=BLUE, linewidth=0, align="edge")
    axes.margins(y=_LABEL_SHARE)
    median = heard.quantiles["0.5"]
    axes.axvline(median, color="black", linewidth=0.7, linestyle="dashed")
    axes.annotate(
        f"median {median:g}",
        (median, 1),
        (3, -2),
        xycoords=("data", "axes fraction"),
        textcoords="offset points",
        va="top",
    )
    axes.set(
        xlabel="access points heard in a fingerprint",
        ylabel="fingerprints",
        xlim=(lowest[0] - 0.5, lowest[-1] + width + 0.5),
    )
    axes.yaxis.set_major_locator(MaxNLocator(5, integer=True))
    return figure


@print_quality
def rssi_by_device(rssi: Mapping[str, DeviceRssi]) -> Figure:
    """Draw what each device hears: quartiles, 5 % to 95 %, mean, and how much louder than others at the same place."""
    devices = sorted(rssi, key=lambda name: rssi[name].rssi_dbm.quantiles["0.5"])
    figure = Figure(figsize=(PAGE_IN, 0.75 + _ROW_IN * max(3, len(devices))), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
    boxes = [_box(rssi[device].rssi_dbm) for device in devices]
    style = {"linewidth": 0.7}
    left.bxp(
        boxes,
        positions=range(len(devices)),
        orientation="horizontal",
        widths=0.6 * min(1, len(devices) / 3),
        showfliers=False,
        showmeans=True,
        patch_artist=True,
        boxprops={**style, "facecolor": "#cfe3f1", "edgecolor": BLUE},
        medianprops={"color": BLUE, "linewidth": 1.4},
        whiskerprops={**style, "color": BLUE},
        capprops={**style, "color": BLUE},
        meanprops={"marker": "d", "markersize": 2.5, "markerfacecolor": "black", "markeredgewidth": 0},
    )
    left.set_yticks(range(len(devices)), devices)
    left.set(xlabel="RSSI / dBm (box: half of the readings, line: 90 %)")
    _offsets(right, [rssi[device] for device in devices])
    for axes in (left, right):
        axes.tick_params(axis="y", length=0)
        axes.grid(axis="x", linewidth=0.3, alpha=0.6)
        axes.set_axisbelow(True)
    letter((left, right), ("What is heard", "Heard by several at the same place"))
    return figure


def _box(values: Distribution) -> dict[str, object]:
    low, first, median, third, high = values.quantiles.values()
    return {"whislo": low, "q1": first, "med": median, "q3": third, "whishi": high, "mean": values.mean, "label": ""}


def _offsets(axes: Axes, rssi: Sequence[DeviceRssi]) -> None:
    """Draw the offset of each device, where it is known, with its number."""
    axes.axvline(0, color="black", linewidth=0.5)
    for row, one in enumerate(rssi):
        if one.offset_db is None:
            axes.annotate("not known", (0, row), (4, 0), textcoords="offset points", va="center", color=QUIET)
            continue
        axes.plot([0, one.offset_db], [row, row], color=ORANGE, linewidth=2.2, solid_capstyle="butt")
        beside = (4, "left") if one.offset_db >= 0 else (-4, "right")
        axes.annotate(
            f"{one.offset_db:+.1f}",
            (one.offset_db, row),
            (beside[0], 0),
            textcoords="offset points",
            va="center",
            ha=beside[1],
        )
    reach = 1.3 * max([abs(one.offset_db or 0.0) for one in rssi] + [1.0])
    axes.set(xlim=(-reach, reach), xlabel="offset from the devices' mean / dB")


@print_quality
def sigma_distribution(sigma: SigmaDistribution) -> Figure:
    """Draw the share of fingerprints that are at least so sure."""
    figure, (axes,) = panel_grid(1, 1, COLUMN_IN, 0.55)
    index = np.array(list(sigma.counts))
    share = np.cumsum(list(sigma.counts.values())) / sigma.fingerprints
    edges = [log_bins.lower_edge_m(int(index[0])), *(log_bins.lower_edge_m(int(i) + 1) for i in index)]
    axes.plot(edges, [0, *share], color=BLUE)
    for value, level, name in ((sigma.median_m, 0.5, "median"), (sigma.p95_m, 0.95, "95 %")):
        axes.plot(value, level, "o", color=BLUE, markersize=3)
        axes.annotate(f"{name}: {value:.2f} m", (value, level), (6, -3), textcoords="offset points", va="top")
    axes.set(
        xscale="log", ylim=(0, 1.03), xlabel="sigma of a fingerprint's position / m", ylabel="share of the fingerprints"
    )
    log_metres(axes.xaxis)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:.0f} %"))
    axes.grid(linewidth=0.3, alpha=0.6)
    return figure


@print_quality
def fingerprints_over_time(sessions: Sequence[SessionStatistics], technology: str) -> Figure:
    """Draw how the labelled fingerprints of walks with a date add up, by device."""
    dated = sorted((walk for walk in sessions if walk.started), key=lambda walk: (walk.started, walk.session))
    devices = sorted({walk.device for walk in dated})
    colours = colours_of(devices)
    figure, (axes,) = panel_grid(1, 1, PAGE_IN, 0.35)
    _steps(axes, dated, technology, "black", "all devices")
    if 1 < len(devices) <= len(PALETTE):
        for device in devices:
            _steps(axes, [walk for walk in dated if walk.device == device], technology, colours[device], device)
        legend_below(figure, [axes])
    locator = AutoDateLocator(maxticks=8)  # type: ignore[no-untyped-call]
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]
    axes.set(ylabel="labelled fingerprints", ylim=(0, None))
    axes.grid(linewidth=0.3, alpha=0.6)
    return figure


def _steps(axes: Axes, walks: Sequence[SessionStatistics], technology: str, colour: str, label: str) -> None:
    counts = [walk.labels[technology].labelled if technology in walk.labels else 0 for walk in walks]
    times = date2num([walk.started for walk in walks if walk.started])  # type: ignore[no-untyped-call]
    at, upto = np.append(times[:1], times), [0, *accumulate(counts)]
    axes.step(at, upto, where="post", color=colour, label=label, marker=".", markersize=2.5)
    axes.xaxis_date()


def covered_floors(
    dataset: Dataset,
    technology: str,
    settings: CoverageSettings,
    starts: Mapping[Storey, tuple[float, float]],
) -> list[CoveredFloor]:
    """Count the cells of every floor and plan the walks that fill its gaps, from its place of ``starts`` if given."""
    return [
        CoveredFloor(
            title=_title(covered.storey),
            floor=dataset.site_floor(covered.storey),
            coverage=covered,
            walks=gap_walks(covered, settings.radius_m, starts.get(covered.storey)),
        )
        for covered in coverage(dataset, technology, settings)
    ]


def dataset_figures(statistics: DatasetStatistics, floors: Sequence[CoveredFloor]) -> Iterator[tuple[str, Figure]]:
    """Yield the figures that there is data for: of Wi-Fi, else of the technology with most fingerprints."""
    if floors:
        yield "coverage", coverage_map(floors)
    if statistics.main is None:
        return
    name, technology = statistics.main
    yield "fingerprints", fingerprints_by_device_and_floor(technology)
    yield "access_points", access_points_heard(technology.heard)
    if technology.rssi:
        yield "rssi", rssi_by_device(technology.rssi)
    if technology.sigma is not None:
        yield "sigma", sigma_distribution(technology.sigma)
    if any(walk.started for walk in statistics.sessions):
        yield "over_time", fingerprints_over_time(statistics.sessions, name)


def _title(storey: Storey) -> str:
    building, number = storey
    return f"{building}, floor {number}" if building else f"Floor {number}"
