"""Fingerprints as a GeoDataFrame: spatial joins and files for GIS, here GeoPackage (needs geopandas)."""

from __future__ import annotations

import tempfile
from pathlib import Path

import geopandas
from shapely.geometry import box

from vislam2tag.api import Dataset, dataset, regular_survey, simulate

BUILDING = (
    'ENGCRS["building",EDATUM["building"],CS[Cartesian,2],AXIS["x",unspecified],AXIS["y",unspecified],'
    'LENGTHUNIT["metre",1]]'
)
"""A plane in metres that is nowhere on earth (WKT 2)."""


def fingerprints_of(made: Dataset) -> geopandas.GeoDataFrame:
    """Labelled fingerprints in the building's metres; `export --format geojson` has degrees where a site has them."""
    table = made.fingerprints.filter(status="ok").select("scan_id", "technology", "device", "floor", "x", "y").collect()
    points = geopandas.points_from_xy(table["x"].to_numpy(), table["y"].to_numpy())
    return geopandas.GeoDataFrame(table.drop("x", "y").to_dict(as_series=False), geometry=points, crs=BUILDING)


def main() -> None:
    """Count the fingerprints in each quarter of a floor."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        simulate(regular_survey(seed=5, floors=(0,), sessions=1, duration_s=120.0), root / "survey")
        scans = fingerprints_of(dataset(root / "survey", root / "set"))
        left, low, right, high = scans.total_bounds
        middle = ((left + right) / 2, (low + high) / 2)
        quarters = geopandas.GeoDataFrame(
            {"quarter": ["south-west", "south-east", "north-west", "north-east"]},
            geometry=[
                box(left, low, *middle),
                box(middle[0], low, right, middle[1]),
                box(left, middle[1], middle[0], high),
                box(*middle, right, high),
            ],
            crs=BUILDING,
        )
        print(scans.sjoin(quarters).groupby("quarter").size().to_string())
        scans.to_file(root / "fingerprints.gpkg", driver="GPKG")
        print(f"{len(scans)} fingerprints, of which a GIS reads {len(geopandas.read_file(root / 'fingerprints.gpkg'))}")


if __name__ == "__main__":
    main()
