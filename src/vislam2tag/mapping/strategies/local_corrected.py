"""The paper's local mapping that gives up sub-trajectories which cannot be right (section V-B)."""

from __future__ import annotations

from vislam2tag.mapping.registry import register
from vislam2tag.mapping.strategies.local import LocalMapping

register("local-corrected", lambda settings: LocalMapping(settings.visit_radius_m, settings.max_step_m, discards=True))
