"""What looks like a mistake about a survey as a whole: landmarks off the plan, walks twice, walks in no floor."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.model import Floor, SessionKey, Site

BESIDE_M = 5.0
"""Landmarks farther beside the plan than this hang on no wall of it."""
POSES = ("poses.csv", "CameraPose.csv")
"""Names of the file that tells walks apart."""
LEAST_BYTES = 10_000
"""Poses of a walk of some seconds have more; less may be alike by chance."""
_SHOWN = 5


def landmarks_off_plan(site: Site, corrections: Corrections) -> list[Finding]:
    """Find floors of which landmarks lie far off the plan: in another unit or frame, or with x and y exchanged.

    Floors whose whole table is corrected are left out.
    """
    corrected = {entry.floor for entry in (*corrections.landmark_units, *corrections.turn_landmarks)}
    found = []
    for floor in site.floors:
        here = site.landmarks.on_floor(floor.number)
        extent_m = floor.extent_m
        if extent_m is None or floor.number in corrected:
            continue
        off = [
            name
            for name, (x, y), surveyed in zip(here.ids, here.position_bcs.tolist(), here.surveyed, strict=True)
            if surveyed and _beside_m(x, y, extent_m) > BESIDE_M
        ]
        if off:
            found.append(_off_plan(floor, off, len(here.ids), extent_m))
    return found


def _beside_m(x: float, y: float, extent_m: tuple[float, float, float, float]) -> float:
    left, right, low, high = extent_m
    return max(left - x, x - right, low - y, y - high)


def _off_plan(floor: Floor, off: Sequence[str], count: int, extent_m: tuple[float, float, float, float]) -> Finding:
    left, right, low, high = extent_m
    names = ", ".join(off[:_SHOWN]) + (", ..." if len(off) > _SHOWN else "")
    message = (
        f"{len(off)} of {count} landmarks of floor {floor.number} ({names}) lie more than {BESIDE_M:g} m off its plan, "
        f"which has x from {left:g} to {right:g} and y from {low:g} to {high:g} m: are they in metres, from the plan's "
        "origin, x before y? vislam2tag diagnose tells units and mirrored tables from the walks"
    )
    return Finding(kind="landmarks_off_plan", file="", count=len(off), message=message, severity=Severity.WARNING)


def walks_in_no_floor(folders: Sequence[Path]) -> list[Finding]:
    """Find folders with walks (DEVICE/SESSION) whose names are no floors', and which nothing reads."""
    return [
        Finding(
            kind="unrecognised_folder",
            file=folder.name,
            count=1,
            message="it holds walks, but only folders named floor_1, floor_2, ... are floors: it is left out; rename "
            "it, or, if it is another building, make that a survey of its own",
            severity=Severity.WARNING,
        )
        for folder in folders
        if any(next(folder.glob(f"*/*/{name}"), None) for name in POSES)
    ]


def walks_twice(root: Path, sessions: Sequence[tuple[SessionKey, Path]]) -> list[Finding]:
    """Find sessions that are copies of others: their poses are the same to the byte."""
    sizes = defaultdict(list)
    for _, folder in sessions:
        for path in (folder / name for name in POSES):
            with suppress(OSError):  # what cannot be read has a finding of its own
                if path.is_file() and (size := path.stat().st_size) >= LEAST_BYTES:
                    sizes[size].append(path)
    found = []
    for paths in sizes.values():
        contents: dict[bytes, Path] = {}
        for path in paths if len(paths) > 1 else ():
            try:
                first = contents.setdefault(read_bytes(path), path)
            except OSError:
                continue
            if first is not path:
                message = (
                    f"holds the same walk as {first.parent.relative_to(root).as_posix()}: it would count twice; remove "
                    "one of the two, or leave it out by [[exclude_session]] in corrections.toml"
                )
                name = path.parent.relative_to(root).as_posix()
                found.append(Finding(kind="walk_twice", file=name, count=1, message=message, severity=Severity.WARNING))
    return found
