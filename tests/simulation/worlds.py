"""Small simulated sessions and surveys for the writer's and the traps' tests."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from hashlib import sha256
from pathlib import Path

from vislam2tag.simulation.phones import SimulatedSession
from vislam2tag.simulation.radio import RadioSettings, make_radio_environment
from vislam2tag.simulation.scenario import Scenario, paper_evaluation, regular_survey
from vislam2tag.simulation.survey import simulate_session


@cache
def clean_scenario() -> Scenario:
    """One walk of 80 s with one phone, nothing wrong with it."""
    return regular_survey(3, "none", (0,), ("LG",), 1, 80.0)


@cache
def paper_scenario() -> Scenario:
    """Two short walks of the paper's evaluation: one over control points, one before the total station."""
    scenario = paper_evaluation(1)
    walks = [next(item for item in scenario.sessions if item.key.device == name) for name in ("LG_ref", "LG_tachy")]
    return replace(scenario, sessions=tuple(replace(item, duration_s=40.0) for item in walks))


@cache
def sessions_of(scenario_name: str) -> tuple[SimulatedSession, ...]:
    """Simulate all sessions of the ``clean`` or ``paper`` scenario."""
    scenario = {"clean": clean_scenario, "paper": paper_scenario}[scenario_name]()
    environment = make_radio_environment(scenario.building, RadioSettings(), scenario.seed)
    return tuple(simulate_session(scenario, planned, environment) for planned in scenario.sessions)


def hashes(root: Path) -> dict[str, str]:
    """SHA-256 of every file below a folder, by relative path."""
    files = sorted(path for path in root.rglob("*") if path.is_file())
    return {path.relative_to(root).as_posix(): sha256(path.read_bytes()).hexdigest() for path in files}
