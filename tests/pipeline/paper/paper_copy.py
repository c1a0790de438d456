"""A small generated copy of the paper's data: the sessions that its figures show, cut short, tracked perfectly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from vislam2tag.simulation.scenario import paper_evaluation
from vislam2tag.simulation.survey import simulate
from vislam2tag.site.model import SessionKey

SECONDS = {
    SessionKey(1, "LG_ref", "2022-01-19T16:06:28"): 100.0,
    SessionKey(1, "OnePlus_ref", "2022-01-19T15:51:00"): 80.0,
    SessionKey(4, "Galaxy", "2021-12-20T14:17:21"): 80.0,
    SessionKey(4, "OnePlus_tachy", "2022-01-14T16:01:04"): 60.0,
    SessionKey(4, "OnePlus_tachy", "2022-01-14T16:18:04"): 60.0,
    SessionKey(4, "Subtrajectory_split", "2022-01-14T16:35:30"): 80.0,
}


def make_paper_copy(out: Path) -> Path:
    """Simulate the copy and return its folder."""
    scenario = paper_evaluation(2, "none")
    sessions = [replace(s, duration_s=SECONDS[s.key]) for s in scenario.sessions if s.key in SECONDS]
    simulate(replace(scenario, sessions=tuple(sessions)), out)
    return out
