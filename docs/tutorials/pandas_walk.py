# %% [markdown]
# # From three CSV files to labels in pandas
#
# You have a walk as three CSV files with headers: the tracker's poses, the landmarks it saw, and their positions. In
# eight lines each row of a fourth table, such as a Wi-Fi log, gets a position in a pandas frame.
#
# You need `pip install 'vislam2tag[pandas]'`. The next cell makes the files from a simulated walk; put yours in their
# place.

# %%
import tempfile
from pathlib import Path

import pandas as pd
import polars as pl

from vislam2tag.api import map_walk, open_survey, read_session, regular_survey, simulate

folder = Path(tempfile.mkdtemp())
simulate(
    regular_survey(
        seed=8,
        floors=(0,),
        devices=("LG",),
        sessions=1,
        duration_s=120.0,
    ),
    folder / "made",
)
survey = open_survey(folder / "made")
session = read_session(survey.sessions[0])
camera, log, marks = session.camera, session.landmarks, survey.site.landmarks


def columns(time_ns, position, orientation):
    named = dict(zip(("px", "py", "pz"), position.T, strict=True))
    turned = dict(zip(("qx", "qy", "qz", "qw"), orientation.T, strict=True))
    return {"timestamp": time_ns, **named, **turned}


pl.DataFrame(columns(camera.time_ns, camera.position_acs, camera.orientation_acs)).write_csv(folder / "poses.csv")
seen = columns(camera.time_ns[log.frame], log.position_acs, log.orientation_acs)
ids = [log.ids[number] for number in log.landmark]
pl.DataFrame({"marker": ids, **seen}).write_csv(folder / "sightings.csv")
x, y = marks.position_bcs.T
pl.DataFrame({"marker": marks.ids, "x": x, "y": y}).write_csv(folder / "landmarks.csv")
session.tables["wifi"].select(pl.col("time_ns").alias("timestamp"), "bssid", "rssi_dbm").write_csv(folder / "wifi.csv")
print(pl.read_csv(folder / "sightings.csv").columns)

# %% [markdown]
# ## Map and label
#
# Columns are recognised by their headers, with their unit if they name one (`time_ms`, `pos_x [mm]`). Times without a
# unit are nanoseconds, positions metres.

# %%
poses = pd.read_csv(folder / "poses.csv")
sightings = pd.read_csv(folder / "sightings.csv")
landmarks = pd.read_csv(folder / "landmarks.csv")
walk = map_walk(poses, sightings, landmarks)
labelled = walk.label(pd.read_csv(folder / "wifi.csv")).to_pandas()
print(labelled[["bssid", "rssi_dbm", "x", "y", "status"]].dropna().round(2).head(3))

# %% [markdown]
# The path is a frame, too:

# %%
print(walk)
path = walk.to_pandas()
print(path.groupby("status")["sigma"].agg(["size", "mean"]).round(3))

# %% [markdown]
# ## If it fails
#
# - **A column is missing**: the message names the table, the missing columns and those that were found. Rename them.
# - **No row has a position**: `walk.findings` contains the reason, for example ids that differ between the tables.
#
# ## Next
#
# - [Label your own walk](own_walk.md) from a survey folder.
# - [Label other sensors](../how-to/other-sensors.md), whose clock may differ.
