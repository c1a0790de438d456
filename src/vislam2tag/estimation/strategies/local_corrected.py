"""The paper's local mapping that gives up sub-trajectories which cannot be right (section V-B)."""

from __future__ import annotations

from vislam2tag.estimation.strategies.local import LocalMapping
from vislam2tag.estimation.strategy import register

register("local-corrected", lambda settings: LocalMapping(settings.visit_radius_m, settings.max_step_m, discards=True))
