"""A site in the published layout, and a site or landmark file in another frame."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.whole_folder import whole_folder
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.text_paths import AnyPath
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.core.similarity import Similarity2
from vislam2tag.site.discover import read_site
from vislam2tag.site.frame_change import (
    CHANGE_FILE,
    FrameChange,
    FrameChanges,
    changed_landmarks_text,
    changed_points_text,
    changes_text,
)
from vislam2tag.site.landmark_file import CONTROL_POINT_FILE, LANDMARK_FILE, table_path
from vislam2tag.site.landmark_states import STATES_FILE, changed_states_text
from vislam2tag.site.links import CURE, left_out_of, outside_link
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.images import GREATEST_PX
from vislam2tag.site.plans.load import plan_file, plan_picture
from vislam2tag.site.site_file import FLOOR_FILE


def write_published(
    root: AnyPath, out: AnyPath, *, follow_links: bool = False
) -> tuple[FrameChanges, tuple[Finding, ...]]:
    """Write a site in the published layout to ``out``, whole: plans as images, landmarks, control points.

    That layout's origin is the plan's lower left corner: positions move there, and ``rebase.toml`` says how. A floor
    without extent has no row in ``floor_dimensions.csv``, which is a finding; and so is what links lead to outside the
    survey, which is left out unless ``follow_links`` is given. Sessions are not copied. Raises
    SurveyError where ``root`` is no site, OutputError where ``out`` cannot be written.
    """
    root, out = Path(root), Path(out)
    site, findings = read_site(root, follow_links=follow_links)
    changes = FrameChanges(
        floors=tuple(
            FrameChange.of(floor.number, Similarity2(1 + 0j, -complex(*floor.lower_left_m))) for floor in site.floors
        )
    )
    with whole_folder(out, _ours) as folder:
        folder.write(FLOOR_FILE, _dimensions(site.floors))
        odd = []
        for floor in site.floors:
            odd += _write_plan(floor, folder.folder(f"floor_{floor.number}").make())
        _write_surveyed(root, folder, changes.by_floor, follow_links)
        folder.write(CHANGE_FILE, changes_text(changes))
    return changes, (*findings, *odd)


def write_changed_site(root: Path, out: Path, changes: FrameChanges, *, follow_links: bool = False) -> list[Finding]:
    """Write the landmark and control point files of a site in another frame to ``out``, whole.

    Those that links lead to outside the site are left out and named, unless ``follow_links`` is given. Raises
    SurveyError where ``root`` is no site or a floor has no change, OutputError where ``out`` cannot be written.
    """
    _, findings = read_site(root, follow_links=follow_links)
    with whole_folder(out, _ours) as folder:
        if not _write_surveyed(root, folder, changes.by_floor, follow_links) and left_out_of(findings):
            raise SurveyError(f"{root}: links lead to all its landmark files outside it; {CURE}")
        folder.write(CHANGE_FILE, changes_text(changes))
    return left_out_of(findings)


def _ours(folder: Path) -> bool:
    """Whether these functions wrote a folder, and nobody has made a survey of it: one with sessions is not replaced."""
    return (folder / CHANGE_FILE).is_file() and not any(folder.glob("floor_*/*/"))


def _dimensions(floors: Iterable[Floor]) -> str:
    rows: list[tuple[object, ...]] = [("id", "width", "height", "elevation", "name")]
    for floor in floors:
        if floor.width_m is not None:
            elevation = "" if floor.elevation_m is None else repr(floor.elevation_m)
            rows.append((floor.number, repr(floor.width_m), repr(floor.height_m), elevation, floor.name))
    return csv_rows(rows)


def _write_plan(floor: Floor, own: Folder) -> list[Finding]:
    drawn = plan_file(floor, own)
    if drawn is None or floor.extent_m is None:
        message = f"floor {floor.number} has no plan that can be drawn; it is written without"
        return [Finding(kind="missing_plan", file=own.path.name, count=1, message=message, severity=Severity.WARNING)]
    if drawn.parent == own.path:
        own.move(drawn.name, own, f"floorplan{drawn.suffix}")
    elif drawn.suffix.lower() in (".jpg", ".jpeg", ".png"):
        own.copy(drawn, f"floorplan{drawn.suffix.lower()}")
    else:
        with own.writing("floorplan.png") as file:
            plan_picture(floor, GREATEST_PX).save(file, "PNG")
    return []


def _write_surveyed(root: Path, out: Folder, changes: Mapping[int, FrameChange], follow_links: bool) -> int:
    """Write every floor's landmark and control point file that there is; return how many."""
    written = 0
    names = [(folder, name) for folder in sorted(root.glob("floor_*")) for name in (LANDMARK_FILE, CONTROL_POINT_FILE)]
    for folder, name in names:
        path = table_path(folder / name)
        if not path.is_file() or not (follow_links or outside_link(root, path) is None):
            continue
        number = _number(path)
        if number not in changes:
            raise SurveyError(f"{path}: there is no change for floor {number}; add it to {CHANGE_FILE}")
        if name == LANDMARK_FILE:
            text = changed_landmarks_text(root, path, changes, number)
        else:
            text = changed_points_text(root, path, changes[number])
        out.write(f"floor_{number}/{name}", text)
        if name == LANDMARK_FILE and (states := changed_states_text(root, folder, changes[number])) is not None:
            out.write(f"floor_{number}/{STATES_FILE}", states)
        written += 1
    return written


def _number(path: Path) -> int:
    try:
        return int(path.parent.name.removeprefix("floor_"))
    except ValueError as error:
        raise SurveyError(f"{path.parent}: is no floor's folder such as floor_1; rename it") from error
