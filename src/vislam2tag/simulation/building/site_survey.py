"""A site's folder for the simulator: its floors with their landmarks, and the files a survey takes over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import Landmarks
from vislam2tag.simulation.building.site_building import SiteFloor, SiteLandmarks
from vislam2tag.simulation.model import SimulatedBuilding
from vislam2tag.site.corrections.file import CORRECTIONS_FILE
from vislam2tag.site.discover import read_site, site_files
from vislam2tag.site.model import Floor, Site
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.site_file import FLOOR_FILE, SITE_FILE, has_site_file
from vislam2tag.site.walkable.graph import corridor_graph
from vislam2tag.site.walkable.plan_cells import floor_mask
from vislam2tag.site.walkable.settings import WalkableSettings
from vislam2tag.site.walkable.space import walkable_space


def site_floors(
    root: Path,
    numbers: Sequence[int] = (),
    landmark_file: Path | None = None,
    masks: Mapping[int, Path] | None = None,
    settings: WalkableSettings | None = None,
) -> tuple[SiteFloor, ...]:
    """Read floors of a site: plan, walkable space, graph, and landmarks (the site's own or those of a file).

    Without ``numbers`` all floors that have a plan are taken. ``masks`` are drawn corrections, by floor. Raises
    SurveyError where there is no such floor, no plan, or nothing that can be walked.
    """
    site, _ = read_site(root, landmark_file=landmark_file, follow_links=True)
    widths = {} if landmark_file is None else _widths(landmark_file)
    chosen = [_floor_of(site, number, root) for number in numbers] or [floor for floor in site.floors if floor.plan]
    if not chosen:
        raise SurveyError(f"{root}: no floor has a plan; add floor_K/floorplan.jpg or a {SITE_FILE}")
    masks, settings = masks or {}, settings or WalkableSettings()
    return tuple(_site_floor(floor, site.landmarks, widths, masks.get(floor.number), settings) for floor in chosen)


def _floor_of(site: Site, number: int, root: Path) -> Floor:
    try:
        return site.floor(number)
    except KeyError as error:
        there = ", ".join(str(floor.number) for floor in site.floors)
        raise SurveyError(f"{root}: has no floor {number}; there are: {there}") from error


def _site_floor(
    floor: Floor, landmarks: Landmarks, widths: Mapping[str, float], mask: Path | None, settings: WalkableSettings
) -> SiteFloor:
    plan = floor_plan(floor)
    space = walkable_space(plan, settings, floor_mask(floor, mask))
    here = landmarks.on_floor(floor.number)
    here = here.select(np.flatnonzero(np.isfinite(here.position_bcs).all(axis=1)).tolist())
    return SiteFloor(
        number=floor.number,
        name=floor.name,
        extent_m=plan.extent_m,
        elevation_m=floor.elevation_m,
        space=space,
        graph=corridor_graph(space, settings.graph),
        landmarks=SiteLandmarks(
            ids=here.ids,
            position=here.position_bcs,
            z_m=here.z_m,
            sigma_m=np.sqrt(here.covariance_bcs[:, 0, 0]).round(6),
            heading_rad=here.heading_rad,
            width_m=_column(here.ids, widths),
        ),
    )


def _column(ids: Sequence[str], widths: Mapping[str, float]) -> FloatArray:
    """Widths (m,) of some landmarks, metres, NaN where not given."""
    return np.array([widths.get(name, np.nan) for name in ids], dtype=np.float64)


def _widths(landmark_file: Path) -> dict[str, float]:
    """Width of the image of each landmark by its id, metres, where the file has a column ``width_m``."""
    table = read_csv(landmark_file, infer_schema=False, truncate_ragged_lines=True)
    if "width_m" not in table.columns:
        return {}
    widths = table.select(table.columns[0], pl.col("width_m").cast(pl.Float64, strict=False)).drop_nulls()
    return dict(widths.iter_rows())


def copied_site_files(root: Path, building: SimulatedBuilding, files: Mapping[str, bytes]) -> dict[str, bytes]:
    """A survey's own site files with the site's ``site.toml``, where it has one, and its plans.

    Raises OSError where one cannot be read.
    """
    described = has_site_file(root)
    taken = {path: text for path, text in files.items() if not (described and path == FLOOR_FILE)}
    folders = {f"floor_{floor.number}" for floor in building.floors}
    for path in site_files(root):
        name = path.relative_to(root)
        own_plan = name.parts[0] in folders and name.stem == "floorplan"
        if own_plan or (described and path.suffix != ".csv" and path.name != CORRECTIONS_FILE):
            taken[name.as_posix()] = read_bytes(path)
    return taken
