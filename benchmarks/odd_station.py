"""How often ``evaluate`` says that a total station's frame contradicts the walks.

Surveys like the paper's, their ten walks of two phones before a total station whose frame hangs on two landmarks that
it shot. Without a fault, whatever is said is a false alarm; then one of the two shots is moved, in a direction drawn at
random. "By shots" is what the distance between the two alone would tell. All that also with a prism that hangs aside
of the camera, which is no fault of the frame.

    python benchmarks/odd_station.py --seeds 61 62 63 64
"""

from __future__ import annotations

import argparse
import tempfile
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
from odd_one_out import drawn

from vislam2tag.core.similarity import as_points
from vislam2tag.evaluation.point_errors import STANDING_M_S, walking_velocity
from vislam2tag.evaluation.total_station.frame import SHOT_RESIDUAL_M
from vislam2tag.evaluation.total_station.station_file import TRACK_FILE, read_station_track
from vislam2tag.pipeline.labels.evaluating.evaluate import evaluate
from vislam2tag.simulation.scenario import paper_evaluation
from vislam2tag.simulation.survey import simulate

SIZES_M = (0.0, 1.0, 0.5)
ASIDE_M = (0.0, 0.3)
"""So far to the left of the camera hangs the prism."""
SHOTS = (2, 3)
"""Lines of the file of shots that are of landmarks."""


def main() -> None:
    """Print for each size of fault how often walks, shots, and either tell it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[61, 62, 63, 64])
    parser.add_argument("--faults", type=int, default=2, help="of each size, to a survey")
    options = parser.parse_args()
    told: dict[tuple[float, float], list[tuple[bool, bool]]] = defaultdict(list)
    rng = np.random.default_rng(options.seeds[0])
    for seed in options.seeds:
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder) / "survey"
            scenario = paper_evaluation(seed)
            before = tuple(one for one in scenario.sessions if one.total_station)
            simulate(replace(scenario, sessions=before), root)
            [shots] = root.rglob("tachymeter/*.csv")
            text = shots.read_text(encoding="utf-8")
            for aside_m, size_m in ((aside_m, size_m) for aside_m in ASIDE_M for size_m in SIZES_M):
                hang(root, aside_m)
                for _ in range(options.faults if size_m else 1):
                    shots.write_text(moved(text, size_m, rng), encoding="utf-8")
                    told[aside_m, size_m].append(told_by(root, Path(folder) / "evaluation"))
    print("| prism aside | shot moved by | surveys | by walks | by shots | by either |")
    print("| --- " * 6 + "|")
    for (aside_m, size_m), found in told.items():
        shares = np.mean([(walks, own, walks or own) for walks, own in found], axis=0)
        cells = " | ".join(f"{share:.0%}" for share in shares)
        print(f"| {aside_m} m | {size_m} m | {len(found)} | {cells} |")


def hang(root: Path, aside_m: float) -> None:
    """Write tracks anew as of a prism so far to the left of where they were measured first, while walking."""
    for path in sorted(root.rglob(TRACK_FILE)):
        first = path.with_suffix(".measured")
        if not first.exists():
            path.rename(first)
        track = read_station_track(first)
        velocity = walking_velocity(track.time_ns, track.time_ns, track.position) @ (1, 1j)
        speed = np.abs(velocity)
        walked = np.flatnonzero(speed > STANDING_M_S)
        last = walked[np.searchsorted(walked, np.arange(len(speed)), side="right").clip(1) - 1]
        left = as_points(1j * aside_m * velocity[last] / speed[last])
        header, *rows = first.read_text(encoding="utf-8").splitlines()
        times = [row.split(";")[0] for row in rows]
        position = (track.position + left).tolist()
        moved_rows = [f"{time};{x:.4f};{y:.4f}" for time, (x, y) in zip(times, position, strict=True)]
        path.write_text("\n".join([header, *moved_rows]) + "\n", encoding="utf-8")


def moved(text: str, size_m: float, rng: np.random.Generator) -> str:
    """The file of shots with one of a landmark moved."""
    lines = text.splitlines()
    row, shift = int(rng.choice(SHOTS)), drawn(size_m, rng)
    time, x, y = lines[row].split(";")
    lines[row] = f"{time};{float(x) + shift.real:.4f};{float(y) + shift.imag:.4f}"
    return "\n".join(lines) + "\n"


def told_by(root: Path, out: Path) -> tuple[bool, bool]:
    """Whether walks of a device contradict the frame, and whether its shots do."""
    sessions = evaluate(root, out, strategies=("smoother",)).sessions
    messages = [one.message for session in sessions for one in session.findings if one.kind == "station_frame"]
    walks = any(message.startswith("around") for message in messages)
    return walks, any((one.estimates.get("station_frame_worst_m") or 0.0) > SHOT_RESIDUAL_M for one in sessions)


if __name__ == "__main__":
    main()
