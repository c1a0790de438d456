"""A site as a drawing or a page, and its walkable floors: a drawing, a mask to correct, the graph as GeoJSON."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from PIL import Image

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath, path_or_none
from vislam2tag.common.files.whole_output import whole_folder, write_file
from vislam2tag.common.findings import Finding, Judgement, Severity, count_of, counted
from vislam2tag.common.tabular import Frames, TabularResult, column_frame, listed_frame, row_frame
from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.discover import read_site, refuse_unknown_floors
from vislam2tag.site.landmark_states import LandmarkCounts
from vislam2tag.site.links import left_out_of, site_name
from vislam2tag.site.model import Floor, Site
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.graph import CorridorGraph, corridor_graph
from vislam2tag.site.walkable.space import WalkableSpace, walkable_space

if TYPE_CHECKING:
    import polars as pl

KINDS = ("png", "pdf", "svg", "html")


@dataclass(frozen=True)
class FloorSummary:
    """A floor with its resolution and findings."""

    floor: Floor
    pixel_m: float | None
    """Width of a pixel of the plan, metres; None if it cannot be drawn."""
    landmarks: LandmarkCounts


@dataclass(frozen=True, repr=False)
class SiteSummary(TabularResult):
    """A site with findings about its files and plans."""

    main_table: ClassVar[str] = "floors"

    site: Site
    floors: tuple[FloorSummary, ...]
    findings: tuple[Finding, ...]

    def _frames(self) -> Frames:
        return {"floors": partial(_floor_frame, self.floors), "findings": partial(listed_frame, self.findings)}

    @property
    def judgement(self) -> Judgement:
        """Judgement of the site's files, with what was checked."""
        plans = sum(one.pixel_m is not None for one in self.floors)
        marks = sum(one.landmarks.total for one in self.floors)
        wrong, warnings = (count_of(severity, self.findings) for severity in (Severity.ERROR, Severity.WARNING))
        missing = len(self.floors) - plans
        why = f"{counted(missing, 'floor')} without a plan, so positions of its landmarks could not be checked"
        looked_at = f"{counted(len(self.floors), 'floor')}, {counted(plans, 'plan')}, {counted(marks, 'landmark')}"
        return Judgement.of(wrong, plans + marks, looked_at, why if missing else "", warnings)


def _floor_frame(floors: Sequence[FloorSummary]) -> pl.DataFrame:
    """A row for each floor: extent and resolution of its plan, metres, and counts of its landmarks."""
    names = ("number", "name", "width_m", "height_m", "elevation_m")
    rows = [
        {**{name: getattr(one.floor, name) for name in names}, "pixel_m": one.pixel_m, "landmarks": one.landmarks}
        for one in floors
    ]
    return row_frame(rows, (*names, "pixel_m"))


def summarise_site(root: AnyPath, floors: Sequence[int] = (), *, follow_links: bool = False) -> SiteSummary:
    """Read a site and load its plans, without files from outside unless ``follow_links``; ``floors``: only these.

    Raises SurveyError if it is not a site, UsageError for an unknown floor.
    """
    root = Path(root)
    site, findings = read_site(root, follow_links=follow_links)
    chosen = [floor for floor in site.floors if not floors or floor.number in floors]
    refuse_unknown_floors(site, floors)
    summaries, odd = [], []
    for floor in chosen:
        pixel_m, problems = _pixel(root, floor)
        odd += problems
        counts = LandmarkCounts.of(site.landmarks.on_floor(floor.number))
        summaries.append(FloorSummary(floor, pixel_m, counts))
    return SiteSummary(site, tuple(summaries), (*findings, *odd))


def _pixel(root: Path, floor: Floor) -> tuple[float | None, list[Finding]]:
    """Size of the plan's pixels, and findings from loading it."""
    if floor.plan is None or floor.extent_m is None:
        return None, []
    try:
        return floor_plan(floor).pixel_m[0], []
    except SurveyError as error:
        message = str(error).removeprefix(f"{floor.plan}: ")
        name = floor.plan.relative_to(root).as_posix()
        return None, [Finding(kind="unusable_plan", file=name, count=1, message=message, severity=Severity.WARNING)]


def title_of(root: Path, *, follow_links: bool = False) -> str:
    """Name of the building, or otherwise of the folder."""
    return site_name(root, follow_links=follow_links) or root.resolve().name


def draw_site(summary: SiteSummary, title: str, out: Path) -> None:
    """Draw a site to a file whose suffix is one of :data:`KINDS`.

    Raises UsageError for any other suffix, OutputError if the file cannot be written.
    """
    from vislam2tag.views.page import data_uri, write_page
    from vislam2tag.views.panels import rendered
    from vislam2tag.views.site_figures import site_plan

    kind = out.suffix.lower().removeprefix(".")
    if kind not in KINDS:
        raise UsageError(f"--out {out}: the name must end with one of {', '.join(f'.{each}' for each in KINDS)}")
    figure = site_plan([each.floor for each in summary.floors], summary.site.landmarks)
    if kind == "html":
        image = data_uri(rendered(figure, "png"))
        write_page(out, "site.html.j2", {"title": title, "summary": summary, "image": image})
        return
    write_file(out, rendered(figure, kind))


RECORD = "walkable.json"


@dataclass(frozen=True, repr=False)
class WalkableFloor(TabularResult):
    """Walkable space of one floor."""

    main_table: ClassVar[str] = "nodes"

    floor: Floor
    space: WalkableSpace
    graph: CorridorGraph

    @property
    def area_m2(self) -> float:
        """Walkable area of the floor, square metres."""
        return float(self.space.area.mask.sum()) * self.space.area.cell_m**2

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings about the plan."""
        return self.space.findings

    def _facts(self) -> dict[str, object]:
        return {"floor": self.floor.number, "area": f"{self.area_m2:.0f} m²", "nodes": len(self.graph.nodes)}

    def _frames(self) -> Frames:
        return {"nodes": self._node_frame, "edges": self._edge_frame, "findings": partial(listed_frame, self.findings)}

    def _node_frame(self) -> pl.DataFrame:
        """Nodes of the graph of corridors, BCS metres."""
        x, y = self.graph.nodes.T
        kinds = [kind.value for kind in self.graph.kinds]
        return column_frame({"x": x, "y": y, "kind": kinds, "width_m": self.graph.width_m})

    def _edge_frame(self) -> pl.DataFrame:
        """Edges by the rows of their nodes."""
        first, second = self.graph.edges.T
        return column_frame({"first": first, "second": second, "length_m": self.graph.length_m})


def write_walkable(
    root: AnyPath,
    out: AnyPath,
    numbers: Sequence[int],
    settings: WalkableSettings,
    mask: AnyPath | None,
    *,
    follow_links: bool = False,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
) -> tuple[WalkableFloor, ...]:
    """Find the walkable space of floors of a site, and write files for each floor to ``out``.

    ``floor_K.png`` is the drawing, ``floor_K.mask.png`` the same as a correction mask to paint on, ``floor_K.geojson``
    the graph in the BCS. ``tell`` is called with plans from outside the survey, which are skipped unless
    ``follow_links`` is given. Raises SurveyError if a floor has no usable plan or walkable space, UsageError for an
    unknown floor or a ``mask`` for several, OutputError if nothing can be written.
    """
    from vislam2tag.site.walkable.painted_cells import floor_mask

    root, out, mask = Path(root), Path(out), path_or_none(mask)
    site, findings = read_site(root, follow_links=follow_links)
    tell(left_out_of(findings))
    chosen = _chosen(site, numbers)
    if mask is not None and len(chosen) != 1:
        raise UsageError("--mask corrects one floor; choose it with --floor")
    found = []
    for floor in chosen:
        space = walkable_space(floor_plan(floor), settings, floor_mask(floor, mask))
        found.append(WalkableFloor(floor, space, corridor_graph(space)))
    if not found:
        raise SurveyError(
            f"{root}: no floor has a plan to draw; add floor_K/floorplan.jpg or a site.toml, or use --follow-links to "
            "draw plans from outside the survey"
        )
    with whole_folder(out, lambda folder: (folder / RECORD).is_file()) as new:
        for one in found:
            _write_floor(one, new, f"floor_{one.floor.number}")
        record = {
            "settings": {"walkable": settings.model_dump(mode="json")},
            "floors": [floor_record(one) for one in found],
        }
        new.write(RECORD, json.dumps(record, indent=2) + "\n")
    return tuple(found)


def _chosen(site: Site, numbers: Sequence[int]) -> list[Floor]:
    refuse_unknown_floors(site, numbers)
    return [site.floor(number) for number in numbers] or [floor for floor in site.floors if floor.plan is not None]


def _write_floor(found: WalkableFloor, folder: Folder, stem: str) -> None:
    from vislam2tag.site.walkable.painted_cells import GREEN, RED
    from vislam2tag.views.panels import rendered
    from vislam2tag.views.site_figures import walkable_figure

    folder.write(f"{stem}.png", rendered(walkable_figure(found.floor, found.space, found.graph), "png"))
    colours = np.where(found.space.area.mask[::-1, :, None], GREEN, RED).astype(np.uint8)
    with folder.writing(f"{stem}.mask.png") as file:
        Image.fromarray(colours).save(file, "PNG")
    folder.write(f"{stem}.geojson", json.dumps(_geojson(found.graph)) + "\n")


def _geojson(graph: CorridorGraph) -> dict[str, object]:
    """Nodes as points, edges as lines, BCS metres to the centimetre."""
    shapes: list[tuple[str, FloatArray, dict[str, object]]] = [
        ("Point", place, {"node": node, "kind": kind.value, "width_m": round(float(width), 2)})
        for node, (place, kind, width) in enumerate(zip(graph.nodes, graph.kinds, graph.width_m, strict=True))
    ]
    rows = zip(
        graph.edges.tolist(), graph.polylines, graph.length_m.round(2), graph.in_room, graph.shortcut, strict=True
    )
    shapes += [
        ("LineString", line, {"nodes": ends, "length_m": float(length), "in_room": bool(room), "shortcut": bool(short)})
        for ends, line, length, room, short in rows
    ]
    features = [
        {"type": "Feature", "properties": about, "geometry": {"type": kind, "coordinates": places.round(2).tolist()}}
        for kind, places, about in shapes
    ]
    return {"type": "FeatureCollection", "features": features}


def floor_record(found: WalkableFloor) -> dict[str, object]:
    """A floor's entry in ``walkable.json``."""
    graph = found.graph
    return {
        "floor": found.floor.number,
        "area_m2": round(found.area_m2, 1),
        "cell_m": found.space.area.cell_m,
        "corridors_m": round(float(graph.length_m[~graph.in_room & ~graph.shortcut].sum()), 1),
        "nodes": dict(sorted(Counter(kind.value for kind in graph.kinds).items())),
        "findings": [finding.model_dump(mode="json") for finding in found.findings],
    }
