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

from vislam2tag.api import map_walk, open_survey, read_session, regular_survey, simulate

folder = Path(tempfile.mkdtemp())
simulate(regular_survey(seed=8, floors=(0,), devices=("LG",), sessions=1, duration_s=120.0), folder / "made")
survey = open_survey(folder / "made")
session = read_session(survey.sessions[0])
for name in ("poses", "sightings", "wifi"):
    session.to_pandas(name).to_csv(folder / f"{name}.csv", index=False)
survey.to_pandas("landmarks").to_csv(folder / "landmarks.csv", index=False)

# %% [markdown]
# ## Map and label
#
# Columns are recognised by their headers, with their unit if they name one (`time_ms`, `pos_x [mm]`). Times without a
# unit are nanoseconds, positions metres. Date-times and dates as text are times, too; without a zone they count as UTC.

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
# - **No row is within the walk**: the message names the factor between the times, and the header that states it.
# - **All frames are `uncertain`**: if `walk.findings` contains `survey_fault`, the landmark table is wrong, for example
#   because x and y are exchanged.
# - **No row has a position**: `walk.findings` contains the reason, for example ids that differ between the tables.
#
# ## Next
#
# - [Label your own walk](own_walk.md) from a survey folder.
# - [Label other sensors](../how-to/other-sensors.md), whose clock may differ.
