# %% [markdown]
# # First steps in Python
#
# In 15 minutes you label a small survey and draw the result. You need no phone and no building: the walks are
# generated.
#
# [Install the program](../how-to/install.md) first.

# %% [markdown]
# ## Generate a survey
#
# A *survey* is a folder of recorded walks (*sessions*) through a building. The simulator writes the files that a phone
# would write: here for one floor, two phones, and two walks each.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import polars as pl

from vislam2tag.api import (
    Settings,
    open_survey,
    process,
    read_session,
    regular_survey,
    simulate,
)

folder = Path(tempfile.mkdtemp())
plan = regular_survey(seed=3, floors=(0,), sessions=2, duration_s=120.0)
simulate(plan, folder / "survey")
survey = open_survey(folder / "survey")
for session in survey.sessions:
    print(session.key)

# %% [markdown]
# ## Look at a walk of the tracker
#
# The phone's tracker estimates the camera's position 30 times a second; each estimate is a *frame*. The track starts at
# (0, 0), drifts, and sometimes jumps. The phone also logs which landmarks the camera saw. Names that end in `_acs` are
# in the tracker's coordinates (y is up), those in `_bcs` in the building's (z is up).

# %% The walk as the tracker logged it, in its own coordinates
walk = read_session(survey.sessions[0])
print(len(walk.camera.time_ns), "frames")
print("landmarks seen:", *walk.landmarks.ids)
figure, axes = plt.subplots(figsize=(5, 4))
position = walk.camera.position_acs
axes.plot(position[:, 0], position[:, 2], color="#d55e00")
axes.set(aspect="equal", xlabel="tracker x, m", ylabel="tracker z, m")

# %% [markdown]
# ## Label it
#
# `process` moves every walk onto the floor plan, using the landmarks that it passed. Each reading gets the position
# of its time. On the command line this is `vislam2tag process survey --out labels`.

# %%
summary = process(folder / "survey", folder / "labels", Settings())
print(f"{summary.sessions} walks, {summary.distance_m:.0f} m")

# %% [markdown]
# ## Check the labels
#
# Each walk has a table of frames and tables of readings. Every row has a
# [status](../reference/statuses.md). The Wi-Fi readings of this survey have three:
#
# - `ok`: the row has a position.
# - `uncertain`: it has a position with a large standard deviation.
# - `duplicate`: the phone logged the same reading twice; it has no position.

# %%
wifi = pl.read_parquet(folder / "labels" / "wifi" / "*.parquet")
counts = wifi.group_by("status").len().sort("len", descending=True)
for status, rows in counts.iter_rows():
    print(f"{status}: {rows} readings")

# %% [markdown]
# The standard deviation of each position (sigma) is small near landmarks and larger between them:

# %% All walks on the floor, coloured by sigma, with the landmarks
frames = pl.read_parquet(folder / "labels" / "trajectory" / "*.parquet")
frames = frames.filter(status="ok")
landmarks = survey.site.landmarks.position_bcs
figure, axes = plt.subplots(figsize=(6, 4))
x, y, sigma = frames["x"], frames["y"], frames["sigma"]
drawn = axes.scatter(x, y, c=sigma, s=4)
figure.colorbar(drawn, label="sigma, m")
axes.plot(*landmarks.T[:2], "s", color="black", label="landmarks")
axes.set(aspect="equal", xlabel="x, m", ylabel="y, m")
axes.legend()

# %% [markdown]
# ## Map one access point
#
# Now every signal strength (RSSI) has a position. Draw those of the access point with the most readings:

# %% Signal strength of one access point, at the positions where it was measured
placed = wifi.drop_nulls("x").group_by("bssid").len()
bssid = placed.sort("len", "bssid", descending=True)["bssid"][0]
readings = wifi.filter(pl.col("bssid") == bssid, status="ok")
figure, axes = plt.subplots(figsize=(6, 4))
x, y, rssi = readings["x"], readings["y"], readings["rssi_dbm"]
drawn = axes.scatter(x, y, c=rssi, s=12)
figure.colorbar(drawn, label="dBm")
axes.set(aspect="equal", xlabel="x, m", ylabel="y, m", title=bssid)

# %% [markdown]
# ## Next
#
# - [Label your own walk](own_walk.md): the folder of a survey, and tables in memory.
# - [From labels to a trained model](trained_model.md): locate a phone by its Wi-Fi scan.
# - [A survey from plan to data set](../how-to/survey.md) in your own building.
