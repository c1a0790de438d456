"""A made site in the layout of the Indoor Location Competition 2.0, of walks whose way is known."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from tests.estimation.dead_reckoning.walks import START_NS, corners, walked

MS = START_NS // 1_000_000
WAYS = {
    "a": np.add(corners((20, 0), (0, 15), (-10, 0)), (5.0, 5.0)),
    "b": np.add(corners((0, 12), (18, 0), (0, -12)), (10.0, 8.0)),
}


def make_site(root: Path) -> Path:
    """Write ``F1`` with a walk for each of :data:`WAYS` and one Wi-Fi reading in each, heard after two seconds."""
    floor = root / "F1"
    (floor / "path_data_files").mkdir(parents=True)
    (floor / "floor_info.json").write_text(json.dumps({"map_info": {"width": 60.0, "height": 40.0}}), encoding="utf-8")
    for name, way in WAYS.items():
        (floor / "path_data_files" / f"{name}.txt").write_text(trace(way), encoding="utf-8")
    return root


def trace(way: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    """A trace file of a walk along corners (k, 2), a tap at each."""
    log, fixes = walked(way, noise=0.05)
    rows: list[tuple[int, str]] = [(MS + 2000, f"TYPE_WIFI\tnet\t04:40:a9:a1:6b:73\t-43\t2437\t{MS + 2000}")]
    rows += [
        (time_ns // 1_000_000, f"TYPE_WAYPOINT\t{x}\t{y}")
        for time_ns, (x, y) in zip(fixes.time_ns.tolist(), fixes.position_bcs.tolist(), strict=True)
    ]
    for kind, values in (("ACCELEROMETER", log.force), ("GYROSCOPE", log.rate), ("ROTATION_VECTOR", log.orientation)):
        sign = np.where(values[:, 3:] < 0, -1, 1) if kind == "ROTATION_VECTOR" else 1
        rows += [
            (time_ns // 1_000_000, f"TYPE_{kind}\t{x}\t{y}\t{z}\t3")
            for time_ns, (x, y, z) in zip(log.rate_ns.tolist(), (values[:, :3] * sign).tolist(), strict=True)
        ]
    head = f"#\tstartTime:{MS}\n#\tBrand:OPPO\tModel:PBCM10\tAndroidName:8.1.0\n"
    return head + "".join(f"{time_ms}\t{text}\n" for time_ms, text in sorted(rows))
