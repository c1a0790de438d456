"""A data set in another frame."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.dataset.folder import dataset_folder, open_dataset_to_share, sha256_of
from vislam2tag.dataset.model import Dataset, DatasetInfo, DatasetSource, FloorInfo
from vislam2tag.dataset.schema import FINGERPRINTS
from vislam2tag.dataset.statistics_record import FieldWork
from vislam2tag.labeling.new_frame import changed_table
from vislam2tag.pipeline.datasets.finish import finish_dataset, read_statistics
from vislam2tag.pipeline.datasets.sources import plan_path
from vislam2tag.survey.discover import read_site, site_files
from vislam2tag.survey.frame_change import CHANGE_FILE, FrameChange, FrameChanges
from vislam2tag.survey.links import outside_link
from vislam2tag.survey.model import Floor, Site
from vislam2tag.survey.plans.load import plan_file

REBASE = "rebase"
"""Kind of the source that the manifest then tells, whose settings hold the changes."""


def rebase_dataset(
    source: Path,
    out: Path,
    changes: FrameChanges,
    new_site: Path,
    building: str | None = None,
    *,
    replace: bool = False,
    follow_links: bool = False,
) -> None:
    """Write a data set in its new frame; what is not of ``building`` stays (None: the only building).

    Tables, floors, plans, page, statistics and card are of the new frame; splits stay as they are. ``replace`` allows
    ``out`` to hold a data set of another command, ``follow_links`` to take files that links lead to outside their
    folder. Raises DatasetError where ``source`` is none, SurveyError where a floor has no change or the new site no
    such floor, UsageError where there are several buildings and none is named, OutputError where ``out`` cannot be
    written.
    """
    dataset = open_dataset_to_share(source, follow_links=follow_links)
    site, _ = read_site(new_site, follow_links=follow_links)
    of_site = _building(dataset.info, building)
    _refuse_missing(dataset, of_site, changes.by_floor)
    with dataset_folder(out, "site rebase", replace) as folder, scratch_folder() as scratch:
        floors, plans = _floors(dataset, of_site, site, scratch)
        several = len({floor.building for floor in dataset.info.floors}) > 1
        only = of_site if several else None
        folder.add_tables({name: _changed(dataset, name, changes.by_floor, only) for name in dataset.tables})
        folder.add_splits(dataset.splits)
        folder.add_files(plans)
        info = _info(dataset.info, floors, changes, of_site, new_site, follow_links)
        finish_dataset(folder, info, _field_work(source), keep_splits=True)


def _building(info: DatasetInfo, wanted: str | None) -> str:
    names = sorted({floor.building for floor in info.floors})
    if wanted is None and len(names) == 1:
        return names[0]
    if wanted not in names:
        raise UsageError(f"--building {wanted or ''}: the data set has the buildings {', '.join(names)}; give one")
    return wanted


def _refuse_missing(dataset: Dataset, building: str, changes: Mapping[int, FrameChange]) -> None:
    own = dataset.fingerprints.filter(pl.col("building").fill_null("") == building)
    found = own.select(pl.col("floor").drop_nulls().unique().sort()).collect(engine="streaming")["floor"]
    for number in found.to_list():
        if number not in changes:
            raise SurveyError(f"there is no change for floor {number}; add it to {CHANGE_FILE}, or to both sites")


def _floors(
    dataset: Dataset, building: str, site: Site, scratch: Folder
) -> tuple[tuple[FloorInfo, ...], dict[str, Path]]:
    """Floors and plans: those of the new site for its building."""
    new = {floor.number: floor for floor in site.floors}
    infos: list[FloorInfo] = []
    plans: dict[str, Path] = {}
    for info in dataset.info.floors:
        if info.building != building:
            infos.append(info)
            if info.plan is not None and info.plan in dataset.files:
                plans[info.plan] = Path(dataset.files[info.plan])
            continue
        if info.number not in new:
            raise SurveyError(f"the new site has no floor {info.number}, which the data set has; add it")
        drawn = plan_file(new[info.number], scratch)
        path = None if drawn is None else plan_path(building, info.number, drawn)
        if path is not None and drawn is not None:
            plans[path] = drawn
        infos.append(_floor(info, new[info.number], path))
    return tuple(infos), plans


def _floor(info: FloorInfo, floor: Floor, plan: str | None) -> FloorInfo:
    return info.model_copy(
        update={
            "elevation_m": floor.elevation_m,
            "width_m": floor.width_m,
            "height_m": floor.height_m,
            "lower_left_m": floor.lower_left_m,
            "georeference": floor.georeference,
            "plan": plan,
        }
    )


def _changed(dataset: Dataset, name: str, changes: Mapping[int, FrameChange], building: str | None) -> pl.LazyFrame:
    table = dataset.tables[name]
    columns = table.collect_schema().names()
    if "floor" not in columns:
        return table
    if building is not None and "building" not in columns:
        buildings = dataset.tables[FINGERPRINTS].select("scan_id", "building")
        table = table.join(buildings, on="scan_id", how="left", maintain_order="left")
    return changed_table(table, changes, building).select(columns)


def _info(
    info: DatasetInfo,
    floors: tuple[FloorInfo, ...],
    changes: FrameChanges,
    building: str,
    new_site: Path,
    follow_links: bool,
) -> DatasetInfo:
    files = [path for path in site_files(new_site) if follow_links or outside_link(new_site, path) is None]
    source = DatasetSource(
        kind=REBASE,
        name=new_site.resolve().name,
        version=__version__,
        settings={"building": building, "floors": [change.model_dump(mode="json") for change in changes.floors]},
        inputs={path.relative_to(new_site).as_posix(): sha256_of(path) for path in files},
    )
    return info.model_copy(update={"floors": floors, "sources": (*info.sources, source), "tables": {}, "splits": {}})


def _field_work(source: Path) -> FieldWork | None:
    """What the survey took as a whole, as the old statistics tell."""
    statistics = read_statistics(source)
    effort = statistics.effort if statistics is not None else None
    if effort is None or effort.people is None:
        return None
    return FieldWork(people=effort.people, hours=effort.person_hours / effort.people)
