"""Map two surveys in object storage on a Dask cluster of two processes, and query the results with Polars.

The storage is moto's server in this process. For your own bucket, remove it and set your credentials.
"""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.request import Request, urlopen

import polars as pl
from moto.server import ThreadedMotoServer

from vislam2tag.api import fleet_add, fleet_status, regular_survey, simulate

CLUSTER = 'kind = "local"\nworkers = 2\n'


def main() -> None:
    """Print how far the fleet is, and what a query over all surveys finds."""
    fleet = Path("s3://walks/hospitals")
    with tempfile.TemporaryDirectory() as folder, object_storage("walks"):
        surveys = [Path(folder) / name for name in ("ward-7", "entrance-hall")]
        for seed, survey in enumerate(surveys, 5):
            simulate(regular_survey(seed=seed, floors=(0,), devices=("LG",), sessions=2, duration_s=60.0), survey)
        fleet_add(fleet, surveys)

        cluster = Path(folder) / "cluster.toml"
        cluster.write_text(CLUSTER)
        command = ["fleet", "process", "s3://walks/hospitals", "--executor", "dask", "--cluster", str(cluster)]
        subprocess.run([sys.executable, "-m", "vislam2tag", *command], check=True)
        totals = fleet_status(fleet)
        print(f"{totals.sessions} sessions of {totals.surveys} surveys: {totals.states}")

        options = {"aws_endpoint_url": os.environ["AWS_ENDPOINT_URL"], "aws_allow_http": "true"}
        wifi = pl.scan_parquet(
            "s3://walks/hospitals/tables/wifi/**/*.parquet", hive_partitioning=True, storage_options=options
        )
        loud = wifi.filter((pl.col("survey") == "ward-7") & (pl.col("rssi_dbm") > -60))  # opens one survey's files
        print(loud.group_by("survey", "floor").agg(pl.len(), pl.col("bssid").n_unique()).collect())


@contextmanager
def object_storage(bucket: str) -> Iterator[None]:
    """Start a server that speaks S3, with one bucket, and point the environment at it."""
    logging.getLogger("werkzeug").setLevel(logging.WARNING)  # no line for each request
    server = ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    endpoint = f"http://{host}:{port}"
    os.environ |= {"AWS_ENDPOINT_URL": endpoint, "AWS_REGION": "us-east-1"}
    os.environ |= {"AWS_ACCESS_KEY_ID": "any", "AWS_SECRET_ACCESS_KEY": "any"}
    try:
        urlopen(Request(f"{endpoint}/{bucket}", method="PUT")).close()  # noqa: S310 - the server of this process
        yield
    finally:
        server.stop()


if __name__ == "__main__":
    main()
