# %% [markdown]
# # The first survey in 15 minutes
#
# For whoever is new: a survey from generated walks, labelled, with pictures. No phone and no building is needed.
#
# A *survey* is a folder of walks through a building. We let the simulator walk: one floor, two phones, two walks each.
# It writes the same files as a phone would, and beside them the truth, which real walks do not have.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import polars as pl

from vislam2tag.api import Settings, open_survey, process, read_session, regular_survey, simulate

folder = Path(tempfile.mkdtemp())
simulate(regular_survey(seed=3, floors=(0,), sessions=2, duration_s=120.0), folder / "survey")
survey = open_survey(folder / "survey")
for session in survey.sessions:
    print(session.key)

# %% [markdown]
# ## What the tracker logged
#
# The tracker has a frame of its own: it knows nothing of the building. It drifts, and now and then it jumps.

# %% The walk as the tracker logged it, in its own frame
walk = read_session(survey.sessions[0])
print(f"{len(walk.camera.time_ns)} frames, landmarks seen: {', '.join(walk.landmarks.ids)}")
figure, axes = plt.subplots(figsize=(5, 4))
axes.plot(walk.camera.position_acs[:, 0], walk.camera.position_acs[:, 2], color="#d55e00")
axes.set(aspect="equal", xlabel="x of the tracker, m", ylabel="z of the tracker, m")

# %% [markdown]
# ## Label it
#
# `process` maps every walk into the building by the landmarks that it passed, and gives every reading a position. On
# the
# command line this is `vislam2tag process survey --out labels`.

# %%
summary = process(folder / "survey", folder / "labels", Settings())
print(f"{summary.sessions} walks, {summary.distance_m:.0f} m")

# %% [markdown]
# ## Look at the labels
#
# Each walk has a table of frames and tables of readings. Every row has a status; `ok` means that it has a position.

# %%
wifi = pl.read_parquet(folder / "labels" / "wifi" / "*.parquet")
for status, rows in wifi.group_by("status").len().sort("len", descending=True).iter_rows():
    print(f"{status}: {rows} readings")

# %% All walks on the floor; the larger a point, the larger its sigma
frames = pl.read_parquet(folder / "labels" / "trajectory" / "*.parquet").filter(status="ok")
marks = survey.site.landmarks.position_bcs
figure, axes = plt.subplots(figsize=(6, 4))
axes.scatter(frames["x"], frames["y"], s=frames["sigma"] * 20, color="#0072b2", linewidths=0)
axes.plot(marks[:, 0], marks[:, 1], "s", color="black", label="landmarks")
axes.set(aspect="equal", xlabel="x, m", ylabel="y, m")
axes.legend()

# %% [markdown]
# ## Where one access point is heard
#
# This is what labels are for: every level has a place now.

# %% Levels of the access point that is heard most
most = wifi.drop_nulls("x").group_by("bssid").len().sort("len", "bssid", descending=True)["bssid"][0]
heard = wifi.filter(pl.col("bssid") == most, status="ok")
figure, axes = plt.subplots(figsize=(6, 4))
drawn = axes.scatter(heard["x"], heard["y"], c=heard["rssi_dbm"], s=12)
figure.colorbar(drawn, label="dBm")
axes.set(aspect="equal", xlabel="x, m", ylabel="y, m", title=most)

# %% [markdown]
# ## Next
#
# - [From labels to a trained model](trained_model.md).
# - [A survey of your own](../how-to/survey.md), from plan to data set.
# - [Statuses](../reference/statuses.md): why a row has a position, or why it has none.
