"""Speed of importing against Polars, which only parses the same file; and the memory that importing needs.

A wide table of UJIIndoorLoc's size (20 000 x 520) is parsed by ``polars.read_csv``, and read and written as a data
set's tables, in turn; the median ratio is printed. Then traces of the Indoor Location Competition 2.0 are repeated over
more and more floors and imported whole by the command line, to see whether memory grows with them.

    python benchmarks/import_speed.py ../shared/data/ilc20
"""

from __future__ import annotations

import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import polars as pl
from measure import seconds, vislam2tag, watched

from vislam2tag.common.files.archives import folder_of
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets.folder import write_dataset
from vislam2tag.datasets.format_registry import ImportContext, import_format_of

ROWS, ACCESS_POINTS, HEARD = 20_000, 520, 18
REPEATS = 7
FLOORS = (4, 32)


def main() -> None:
    """Measure both and print the ratios."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wide = _wide_table(folder / "UTS_training.csv")
        pairs = [(seconds(_parse, wide), seconds(_import, wide, folder)) for _ in range(REPEATS)]
        ratio = statistics.median(ours / theirs for theirs, ours in pairs)
        print(f"{ROWS} x {ACCESS_POINTS}: importing takes {ratio:.2f} times polars.read_csv of the same file")
        parsing = watched(_run, f"import polars; polars.read_csv({str(wide)!r})").resident_mb
        importing = watched(vislam2tag, "import", str(wide), "--out", str(folder / "set")).resident_mb
        print(f"peak memory: polars.read_csv {parsing:.0f} MB, vislam2tag import {importing:.0f} MB")
        if len(sys.argv) > 1:
            floor = folder_of(Path(sys.argv[1]), Folder.at(folder)) / "site2" / "F4"
            few, many = (watched(_import_floors, floor, folder, count).resident_mb for count in FLOORS)
            print(f"peak memory: {few:.0f} MB for {FLOORS[0]} floors, {many:.0f} MB for {FLOORS[1]} floors of traces")


def _wide_table(path: Path) -> Path:
    random = np.random.default_rng(0)
    levels = np.full((ROWS, ACCESS_POINTS), 100, dtype=np.int64)
    column = np.argsort(random.random((ROWS, ACCESS_POINTS)), axis=1)[:, :HEARD]
    np.put_along_axis(levels, column, random.integers(-100, -30, column.shape), axis=1)
    table = pl.DataFrame(levels, schema=[f"WAP{number:03d}" for number in range(1, ACCESS_POINTS + 1)])
    place = pl.DataFrame(random.uniform(0, 100, (ROWS, 2)).round(3), schema=["Pos_x", "Pos_y"])
    floor = pl.DataFrame({"Floor_ID": random.integers(0, 5, ROWS)})
    pl.concat([table, place, floor], how="horizontal").write_csv(path)
    return path


def _parse(path: Path) -> None:
    pl.read_csv(path)


def _import(path: Path, folder: Path) -> None:
    with tempfile.TemporaryDirectory() as scratch:
        write_dataset(import_format_of(path).read(path, ImportContext(Folder.at(Path(scratch)))), folder / "tables")


def _run(code: str) -> None:
    subprocess.run([sys.executable, "-c", code], check=True)


def _import_floors(floor: Path, folder: Path, count: int) -> None:
    site = folder / f"{count}" / "mall"
    for number in range(1, count + 1):
        shutil.copytree(floor, site / f"F{number}")
    vislam2tag("import", str(site), "--out", str(folder / "mall"))


if __name__ == "__main__":
    main()
