"""Learn the speed model of dead reckoning from traces with taps, and write it beside what it was learned from.

    python benchmarks/train_speed.py site1/F1 src/vislam2tag/estimation/dead_reckoning/speed_model.json

The folder is a floor of the Indoor Location Competition 2.0 (MIT licence; ../shared/data/ilc20/site1-F1.tar.xz).
"""

from __future__ import annotations

import hashlib
import json
import sys
from pathlib import Path

from training import carried_walks, train

from vislam2tag.core.context import FixLog, InertialLog
from vislam2tag.estimation.dead_reckoning.gait import NAMES
from vislam2tag.estimation.settings import DeadReckoningSettings
from vislam2tag.sessions.tables.ilc20_trace import parse_trace
from vislam2tag.sessions.without_poses import inertial_log


def logged_walks(folder: Path) -> list[tuple[InertialLog, FixLog]]:
    """Read the traces below a floor's folder that have inertial readings, and their taps."""
    walks = []
    for path in sorted(folder.glob("path_data_files/*.txt")):
        trace = parse_trace(path.read_bytes(), path.name)
        inertial = inertial_log(trace.sensors)
        if inertial is not None:
            walks.append((inertial, trace.taps))
    return walks


def main() -> None:
    """Train and write."""
    folder, target = Path(sys.argv[1]), Path(sys.argv[2])
    walks = logged_walks(folder)
    model = train(carried_walks(walks), DeadReckoningSettings())
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(folder.glob("path_data_files/*.txt"))))
    record = {
        "learned_from": f"Indoor Location Competition 2.0, {folder.parent.name}/{folder.name}",
        "licence": "MIT (data: Microsoft Research, location-competition/indoor-location-competition-20)",
        "walks": len(walks),
        "each_walk": "as recorded, phone in the hand, and as a swinging hand would have recorded it",
        "sha256": digest.hexdigest(),
        "command": f"python benchmarks/train_speed.py site1/F1 {sys.argv[2]}",
        "unit": "m/s",
        "coefficients": dict(zip(NAMES, model.coefficients.round(5).tolist(), strict=True)),
    }
    target.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
