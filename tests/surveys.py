"""Simulated surveys for end-to-end tests."""

from __future__ import annotations

import hashlib
from pathlib import Path

from vislam2tag.pipeline.run.failures import LOG_FILE
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import WritingOptions, simulate


def make_survey(
    out: Path,
    *,
    floors: int = 1,
    devices: tuple[str, ...] = ("LG", "OnePlus"),
    sessions: int = 1,
    seconds: float = 40.0,
    severity: str = "none",
    traps: tuple[str, ...] = (),
    seed: int = 3,
) -> Path:
    """Simulate a small survey and return its folder."""
    scenario = regular_survey(seed, severity, tuple(range(floors)), devices, sessions, seconds)
    simulate(scenario, out, WritingOptions(traps=frozenset(traps)))
    return out


def bytes_of(folder: Path) -> dict[str, str]:
    """SHA-256 of every file below a folder, by relative path; logs, which tell of one run each, are left out."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != LOG_FILE
    }
