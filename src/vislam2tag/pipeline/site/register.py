"""Registers a floor: from surveyors' files to positions, which are written to the site or a folder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import OutputError, UsageError
from vislam2tag.common.files.given_files import AnyPath, path_or_none, paths_of
from vislam2tag.common.files.whole_output import whole_folder
from vislam2tag.common.findings import Finding
from vislam2tag.core.transforms import as_complex
from vislam2tag.preparation.registration.names import LandmarkTable, NameRules
from vislam2tag.preparation.registration.point_columns import PointColumn
from vislam2tag.preparation.registration.record import Registration, RegistrationSettings
from vislam2tag.preparation.registration.register import (
    FloorMeasurements,
    known_points_of_site,
    read_known_points,
    read_stations,
    register_floor,
)
from vislam2tag.preparation.registration.results import control_point_text, landmark_text, measured_states
from vislam2tag.preparation.registration.tape_and_clicks import read_clicks, read_distances, read_targets
from vislam2tag.site.discover import read_site, refuse_unknown_floors
from vislam2tag.site.landmark_file import CONTROL_POINT_FILE, LANDMARK_FILE
from vislam2tag.site.landmark_states import STATES_FILE, updated_states_text
from vislam2tag.site.links import write_in_survey
from vislam2tag.site.model import Floor, Site
from vislam2tag.views.panels import rendered
from vislam2tag.views.site_figures import residual_figure

RECORD_FILE = "registration.json"
FIGURE_FILES = ("residuals.svg", "residuals.png")


@dataclass(frozen=True)
class FloorFiles:
    """Files of one floor, and how to read them."""

    stations: AnyPath | Sequence[AnyPath] = ()
    control: AnyPath | None = None
    known: Sequence[str] = ()
    """Known points of the site by name; ``all``: all of them."""
    tape: AnyPath | None = None
    targets: AnyPath | None = None
    clicks: AnyPath | None = None
    columns: Sequence[PointColumn | None] | None = None
    codes: Sequence[str] = ()
    rules: NameRules = field(default_factory=NameRules)
    free_scale: bool = False


def floor_of(root: Path, number: int | None) -> tuple[Site, Floor]:
    """Read the site and choose its floor, or the only one without a number; raises UsageError otherwise."""
    site, _ = read_site(root, follow_links=True)
    if not site.floors:
        raise UsageError(f"{root}: the site has no floor; add one with vislam2tag site init")
    if number is None:
        if len(site.floors) != 1:
            there = ", ".join(str(floor.number) for floor in site.floors)
            raise UsageError(f"--floor: the site has several floors ({there}); choose one")
        return site, site.floors[0]
    refuse_unknown_floors(site, [number])
    return site, site.floor(number)


def register(site: Site, floor: Floor, sources: FloorFiles, settings: RegistrationSettings) -> Registration:
    """Read all files and adjust them.

    Raises UsageError without measurements, SurveyError if a file cannot be used or a frame is not determined.
    """
    if not sources.stations and sources.tape is None and sources.clicks is None:
        raise UsageError("there are no measurements; use --station, --tape or --clicks")
    if sources.stations and sources.control is None and not sources.known:
        raise UsageError(
            "--station needs known points; use --control FILE, or --known ID for landmarks of the site (--known all)"
        )
    measured, findings = _measured(site, floor, sources, settings)
    return register_floor(floor.number, measured, free_scale=sources.free_scale, findings=findings)


def _measured(
    site: Site, floor: Floor, sources: FloorFiles, settings: RegistrationSettings
) -> tuple[FloorMeasurements, list[Finding]]:
    rules, stations = sources.rules, paths_of(sources.stations)
    shots, findings = read_stations(stations, sources.columns, sources.codes, rules, settings)
    known = known_points_of_site(site, floor.number, sources.known, rules, settings)
    if sources.control is not None:
        more, problems = read_known_points(Path(sources.control), rules, settings)
        named = {one.point for one in more}
        known = [*more, *(one for one in known if one.point not in named)]
        findings += problems
    distances, problems = ([], []) if sources.tape is None else read_distances(Path(sources.tape), settings)
    targets, more_problems = ({}, []) if sources.targets is None else read_targets(Path(sources.targets), settings)
    clicked = path_or_none(sources.clicks)
    clicks, click_problems = ({}, []) if clicked is None else read_clicks(clicked, floor.number, settings)
    here = site.landmarks.on_floor(floor.number)
    expected = {here.ids[i]: complex(as_complex(here.position_bcs[i])) for i in np.flatnonzero(here.surveyed).tolist()}
    measured = FloorMeasurements(
        shots=shots,
        known=known,
        height_sigma_m=settings.height_sigma_m,
        distances=distances,
        targets=targets,
        clicks=clicks,
        expected=expected,
        table=LandmarkTable(floor.number, here.ids, here.planned_ids),
        extent_m=floor.extent_m,
    )
    return measured, [*findings, *problems, *more_problems, *click_problems]


def write_into_site(root: Path, floor: Floor, found: Registration, *, replace: bool) -> list[Path]:
    """Write the landmarks (and control points) to the floor's own files, with the record in the same folder.

    Raises OutputError if the names are not those of the landmark table, or if the files have other positions and
    ``replace`` is not given; then nothing is written.
    """
    if found.has_other_names:
        raise OutputError(
            f"{_folder_of(root, floor) / LANDMARK_FILE}: the measured names are not in the table, so nothing was "
            "written; give the points ids of the table, or add rows with their ids to it"
        )
    folder = _folder_of(root, floor)
    texts = _texts(root, folder, floor, found, replace=replace)
    for name, text in texts.items():
        write_in_survey(root, folder / name, text)
    return [folder / name for name in texts]


def write_folder(out: Path, root: Path, floor: Floor, found: Registration) -> list[Path]:
    """Write the floor's future files, the record and the figure to a separate folder."""
    texts = _texts(root, _folder_of(root, floor), floor, found, replace=True)
    figure = residual_figure(floor, found)
    with whole_folder(out, _is_ours) as new:
        for name, text in texts.items():
            new.write(name, text)
        for name in FIGURE_FILES:
            new.write(name, rendered(figure, name.rpartition(".")[2]))
    return [out / name for name in (*texts, *FIGURE_FILES)]


def check_out(out: Path, root: Path) -> None:
    """Raise OutputError if the folder is the site or among its floors."""
    place, site = out.resolve(), root.resolve()
    if place == site or (site in place.parents and place.relative_to(site).parts[0].startswith("floor_")):
        raise OutputError(f"{out}: this folder is among the site's own files; choose another name, or use --write")


def _is_ours(folder: Path) -> bool:
    return (folder / RECORD_FILE).is_file()


def _folder_of(root: Path, floor: Floor) -> Path:
    return root / f"floor_{floor.number}"


def _texts(root: Path, folder: Path, floor: Floor, found: Registration, *, replace: bool) -> dict[str, str]:
    """Text of each file by name; the record comes last."""
    texts: dict[str, str] = {}
    if found.landmarks:
        texts[LANDMARK_FILE] = landmark_text(root, folder, floor.number, found.landmarks, replace=replace)
        texts[STATES_FILE] = updated_states_text(root, folder, measured_states(found.landmarks))
    if found.control_points:
        texts[CONTROL_POINT_FILE] = control_point_text(root, folder, found.control_points, replace=replace)
    return texts | {RECORD_FILE: found.model_dump_json(indent=1) + "\n"}
