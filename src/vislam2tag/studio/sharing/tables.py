"""Walks, charts, scans and radio maps as Parquet, in groups of rows of which the page reads those that it needs.

A group's statistics tell its sessions, floors and places, so that a walk or a part of a floor is a few ranges of bytes.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.table_files import scan_parquet, write_parquet
from vislam2tag.studio.radio.maps import NUMBER, STRONGEST, Radio
from vislam2tag.studio.series import scans_table, series_columns, session_series
from vislam2tag.studio.session_view import overview
from vislam2tag.studio.tracks import FULL, joined
from vislam2tag.studio.workspace import Workspace

GROUP_ROWS = 8192
"""Frames of four minutes or so; and few enough groups for a short list of them at the file's end."""
CHART_POINTS = 2000
STRIDE = "stride"
"""In an overview's own notes: every so manieth frame is in it."""
LAYERS_OF_POINT = ("mean_dbm", "heard", "deviation_db", "sigma_db")
_FRAMES = {"session": np.uint16, **FULL}
_SERIES = {"session": np.uint16, "series": np.uint8, "t": np.float32, "v": np.float32}


def write_output(workspace: Workspace, output: str, folder: Folder, done: Callable[[str], None]) -> None:
    """Write the walks of an output: all thinned, every frame, scans and charts; ``done`` is told of each walk."""
    columns, stride = overview(workspace, output)
    write_rows(pl.DataFrame(dict(columns)), folder, "overview.parquet", {STRIDE: str(stride)})
    write_rows(scans_table(workspace, output), folder, "scans.parquet")
    with scratch_folder(folder) as scratch:
        for index, id in enumerate(workspace.now.ids):
            write_rows(_frames(workspace, index, output), scratch, f"frames/{index:06d}.parquet")
            write_rows(_series(workspace, index, output), scratch, f"series/{index:06d}.parquet")
            done(id)
        for name, schema in (("frames", _FRAMES), ("series", _SERIES)):
            parts = sorted((scratch / name).glob("*"))
            whole = scan_parquet(parts) if parts else pl.DataFrame({k: np.empty(0, v) for k, v in schema.items()})
            write_rows(whole, folder, f"{name}.parquet")


def write_radio(radio: Radio, folder: Folder) -> None:
    """Write the maps of each floor and technology: of all access points together, and those of each as a group."""
    for maps in radio.floors:
        floor, technology = maps.place.floor, maps.place.technology
        layers = {name: radio.layer(floor, technology, name, "")[1].ravel() for name in (STRONGEST, NUMBER)}
        write_rows(pl.DataFrame(layers), folder, f"{floor}-{technology}-all.parquet")
        cells = pl.DataFrame({name: getattr(maps, name).astype(np.float32).ravel() for name in LAYERS_OF_POINT})
        write_rows(cells, folder, f"{floor}-{technology}.parquet", group_rows=maps.grid.rows * maps.grid.columns)


def _frames(workspace: Workspace, index: int, output: str) -> pl.DataFrame:
    track = workspace.track(workspace.now.ids[index], output)
    return pl.DataFrame(dict(joined([] if track is None else [(index, track)], tuple(FULL))))


def _series(workspace: Workspace, index: int, output: str) -> pl.DataFrame:
    try:
        found = session_series(workspace, workspace.now.ids[index], output)
    except SessionError:  # the list of walks tells it
        found = {}
    columns = series_columns(found, CHART_POINTS, (-np.inf, np.inf))
    return pl.DataFrame({"session": np.full(len(columns["t"]), index, np.uint16), **columns})


def write_rows(
    table: pl.DataFrame | pl.LazyFrame,
    folder: Folder,
    name: str,
    notes: dict[str, str] | None = None,
    group_rows: int = GROUP_ROWS,
) -> None:
    """Write a table as the page reads it, in groups of so many rows; with ``notes`` in the file's own words."""
    options = {"compression": "snappy", "row_group_size": group_rows, "statistics": True, "metadata": notes}
    write_parquet(table, folder, name, **options)
