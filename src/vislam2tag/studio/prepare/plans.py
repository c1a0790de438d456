"""Planned landmarks of a floor, by the functions of ``vislam2tag plan``: these run in the process of ``work``."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vislam2tag import __version__
from vislam2tag.common.errors import OutputError, UsageError
from vislam2tag.core.arrays import IntArray
from vislam2tag.pipeline.site.plan import PlanRequest, add_to_site, constraints_of, designed
from vislam2tag.preparation.planning.floor import ChangedPlan
from vislam2tag.preparation.planning.prediction import mean_error_m
from vislam2tag.preparation.planning.records import PlanSummary, floor_summary, new_ids
from vislam2tag.preparation.planning.settings import PlanSettings
from vislam2tag.preparation.sheets.settings import sheet_size
from vislam2tag.settings import Settings
from vislam2tag.site.discover import read_site
from vislam2tag.site.model import Floor
from vislam2tag.studio.prepare.messages import HeldLandmark, PlanChange, PlannedMark, PlannedView, PlanWish

KEPT = 4
"""Plans remembered; the oldest goes."""


class _Plan:
    """A floor's plan and what may be changed of it."""

    def __init__(self, root: Path, wish: PlanWish, settings: Settings) -> None:
        """Plan the floor of a survey; raises SurveyError or UsageError as ``vislam2tag plan`` does."""
        site, _ = read_site(root, follow_links=True)
        self.floor: Floor = site.floor(wish.floor)
        asked: dict[str, object] = {"spacing_m": wish.spacing_m, "rooms": wish.rooms, "further": 0}
        asked |= {"sheets": tuple(sheet_size(name).name for name in wish.sheets)}
        self.settings = PlanSettings.model_validate(settings.plan.model_dump() | asked)
        given = constraints_of(site, self.floor)
        design, graph = designed(self.floor, PlanRequest(walkable=settings.walkable), self.settings, given)
        self.changed = ChangedPlan(design, graph, self.settings)
        self.taken = site.landmarks.ids
        self.fewest = len(design.place)
        ids = self.ids(self.fewest, [])
        self.record = floor_summary(design, self.floor.number, self.floor.name, ids, self.settings)

    def ids(self, count: int, held: list[HeldLandmark]) -> list[str]:
        """Ids of ``count`` landmarks more than those that are held."""
        return new_ids(count, 1, (*self.taken, *(one.id for one in held)))

    def view(self, number: int, held: list[HeldLandmark]) -> PlannedView:
        """What the page shows of the plan with these landmarks."""
        design, place = self.changed.design, _places(held)
        found = self.changed.expectation(place)
        error_m, grid = mean_error_m(found.expected), found.sigma.grid
        cm = np.nan_to_num(np.round(100 * found.sigma.sigma_m), nan=-1).astype(int)
        positions = design.places.position[place].round(3).tolist()
        return PlannedView(
            plan=number,
            floor=self.floor.number,
            landmarks=[
                PlannedMark(id=one.id, place=one.place, x=x, y=y, sheet=design.places.sheet[one.place])
                for one, (x, y) in zip(held, positions, strict=True)
            ],
            fixed=len(design.constraints.names),
            fewest=self.fewest,
            expected_error_m=None if np.isnan(error_m) else error_m,
            longest_m=None if design.demands.gaps else found.longest_m,
            extent_m=grid.extent_m,
            rows=grid.rows,
            columns=grid.columns,
            sigma_cm=cm.ravel().tolist(),
            notes=[*(one.message for one in self.record.findings), *(one.message for one in self.record.unmet)],
        )

    def written(self, held: list[HeldLandmark]) -> PlanSummary:
        """The plan with these landmarks as ``vislam2tag plan`` writes it."""
        design = self.changed.designed(_places(held))
        ids = [one.id for one in held]
        record = floor_summary(design, self.floor.number, self.floor.name, ids, self.settings)
        return PlanSummary(version=__version__, settings=self.settings, floors=(record,), findings=())


_plans: dict[int, _Plan] = {}


def _places(held: list[HeldLandmark]) -> IntArray:
    return np.array([one.place for one in held], dtype=np.int64)


def make_plan(number: int, root: Path, wish: PlanWish, settings: Settings) -> PlannedView:
    """Plan a floor, and remember the plan by a number."""
    plan = _Plan(root, wish, settings)
    place = plan.changed.design.place.tolist()
    more = (wish.number or 0) - len(place) - int((plan.changed.design.fixed_station >= 0).sum())
    if more > 0:
        place += plan.changed.further(np.array(place, dtype=np.int64), more)
    held = [HeldLandmark(id=id, place=at) for id, at in zip(plan.ids(len(place), []), place, strict=True)]
    _plans[number] = plan
    for old in list(_plans)[:-KEPT]:
        del _plans[old]
    return plan.view(number, held)


def change_plan(change: PlanChange) -> PlannedView:
    """The plan with other landmarks, or one of them moved to or added at the place nearest to a point."""
    plan, held = _plan(change.plan), list(change.landmarks)
    if max((one.place for one in held), default=0) >= len(plan.changed.design.places.station):
        raise UsageError("there is no such place; plan again")
    if change.to is not None:
        others = [one for one in held if one.id != change.moved]
        place = plan.changed.nearest_place(np.array(change.to), _places(others))
        moved = HeldLandmark(id=change.moved or plan.ids(1, held)[0], place=place)
        held = [moved if one.id == change.moved else one for one in held]
        held += [] if change.moved else [moved]
    return plan.view(change.plan, held)


def write_plan(change: PlanChange, root: Path) -> int:
    """Add the landmarks to the floor's own file; returns how many."""
    summary = _plan(change.plan).written(list(change.landmarks))
    add_to_site(root, summary)
    return len(summary.landmarks)


def _plan(number: int) -> _Plan:
    if number not in _plans:
        raise OutputError("the plan is not there any more; plan again")
    return _plans[number]
