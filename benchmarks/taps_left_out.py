"""How wrong positions between taps are: inner taps of real walks are left out and interpolated.

Corners lie at taps, so that the straight line past a tap left out is not where anybody walked; only the error along the
way counts: the way walked up to the tap against the share of the time. Walks of the Indoor Location Competition 2.0.

    python benchmarks/taps_left_out.py ../shared/data/ilc20/site2-F4.tar.xz
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from vislam2tag.common.files.archives import folder_of
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import FixLog
from vislam2tag.dataset.formats.ilc20.site_folders import find_sites
from vislam2tag.dataset.reading.waypoints import PACE_M2_S, TAP_SIGMA_M
from vislam2tag.sessions.tables.ilc20_trace import parse_trace

SPANS_S = ((0, 7), (7, 10), (10, 14), (14, 30))
"""From the tap before to the tap after the one left out."""


def main() -> None:
    """Print errors and what sigma says of them, by the time between the taps kept."""
    with scratch_folder() as scratch:
        traces = find_sites(folder_of(Path(sys.argv[1]), scratch)).traces
        walks = [parse_trace(ref.path.read_bytes(), ref.path.name).taps for ref in traces]
    span_s, error_m, stated_m = np.concatenate([_errors(taps) for taps in walks if len(taps.time_ns) > 2]).T
    for low, high in (*SPANS_S, (0, 30)):
        rows = (span_s >= low) & (span_s < high)
        wrong, said = (np.sqrt(np.mean(values[rows] ** 2)) for values in (error_m, stated_m))
        print(f"{low:2d} to {high:2d} s: {rows.sum():3d} taps, error {wrong:.2f} m, stated {said:.2f} m (RMS)")


def _errors(taps: FixLog) -> FloatArray:
    """Span (s), error along the way (m) and its stated standard deviation (m) for each inner tap."""
    step_s, step_m = np.diff(taps.time_ns) * 1e-9, np.linalg.norm(np.diff(taps.position_bcs, axis=0), axis=1)
    since_s, until_s = step_s[:-1], step_s[1:]
    span_s = since_s + until_s
    share = since_s / span_s
    error_m = step_m[:-1] - share * (step_m[:-1] + step_m[1:])
    taps_m2 = TAP_SIGMA_M**2 * (1 + share**2 + (1 - share) ** 2)
    return np.stack((span_s, error_m, np.sqrt(taps_m2 + PACE_M2_S * since_s * until_s / span_s)), axis=1)


if __name__ == "__main__":
    main()
