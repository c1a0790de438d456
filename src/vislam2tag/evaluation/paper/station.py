"""The paper's evaluation before a total station (section VI-B): all walks of one phone, with one clock offset."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from vislam2tag.core.similarity import Similarity2
from vislam2tag.evaluation.paper.walks import Mapped, PaperWalk, paper_walk
from vislam2tag.evaluation.total_station.station_errors import JUMP_M, clock_offset, station_point_errors
from vislam2tag.evaluation.total_station.station_file import StationTrack
from vislam2tag.evaluation.truth import Truth
from vislam2tag.mapping.settings import MappingSettings
from vislam2tag.sessions.model import Session

CLOCK_STRATEGY = "local-corrected"
"""Whose errors the clock offset makes least, as in the paper."""


@dataclass(frozen=True)
class StationWalks:
    """The walks of one phone before a total station; ``clock_ns`` is the station's wall clock minus its boot clock."""

    walks: tuple[PaperWalk, ...]
    clock_ns: int


def station_settings(settings: MappingSettings) -> MappingSettings:
    """Settings with which the paper maps walks before the total station: shorter steps are breaks."""
    return settings.model_copy(update={"max_step_m": JUMP_M})


def station_walks(
    sessions: Sequence[tuple[Session, Mapped, StationTrack]], bcs_T_station: Similarity2, max_sigma_m: float
) -> StationWalks:
    """Compare the mapped sessions of one phone with the station's tracks (see :func:`paper_walk` for the labels).

    As in the paper the clock offset is fitted to the very errors it is then used for.
    """
    clock_ns = clock_offset([(mapped[CLOCK_STRATEGY], track) for _, mapped, track in sessions], bcs_T_station)

    walks = []
    for session, mapped, track in sessions:
        truth = Truth(track.time_ns - clock_ns, bcs_T_station @ track.position)
        walks.append(paper_walk(session, mapped, partial(station_point_errors, truth=truth), max_sigma_m))
    return StationWalks(tuple(walks), clock_ns)
