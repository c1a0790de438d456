# %% [markdown]
# # Label your own walk
#
# You have a recorded walk and want a position for each of its readings. Put the walk into a survey folder, or pass
# its tables to one function.
#
# You need a walk of the phone app, or in the [file layout of the VI-SLAM2tag data set](../reference/session-files.md),
# and the positions of two or more landmarks that it passed. Here the simulator makes the walk; put yours in its place.

# %%
import shutil
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import polars as pl

import vislam2tag
from vislam2tag.api import Settings, label, process, regular_survey, simulate

folder = Path(tempfile.mkdtemp())
plan = regular_survey(
    seed=8,
    floors=(0,),
    devices=("LG",),
    sessions=1,
    duration_s=120.0,
)
simulate(plan, folder / "made")
walk = next((folder / "made" / "floor_0" / "LG").iterdir())
print("files:", *sorted(path.name for path in walk.iterdir()))

# %% [markdown]
# ## Make the survey folder
#
# A survey needs three things:
#
# - `floor_dimensions.csv`: width and height of the floor plan in metres.
# - `floor_0/marker_dict.csv`: where each landmark hangs, in metres. On the plan, x points to the right and y up ([how
#   to measure](../how-to/registration.md)).
# - `floor_0/DEVICE/WALK`: a folder for each walk.

# %%
survey = folder / "survey"
(survey / "floor_0" / "LG").mkdir(parents=True)
shutil.copytree(walk, survey / "floor_0" / "LG" / "my_walk")
for table in ("floor_dimensions.csv", "floor_0/marker_dict.csv"):
    shutil.copy(folder / "made" / table, survey / table)
print((survey / "floor_dimensions.csv").read_text())
lines = (survey / "floor_0" / "marker_dict.csv").read_text().splitlines()
print("\n".join(lines[:4]))

# %% [markdown]
# A landmark table from a spreadsheet works too: `vislam2tag inspect survey` shows how its columns were read.

# %% [markdown]
# ## Label the walk
#
# On the command line: `vislam2tag process survey --out labels`. Problems in the files are
# [findings](../reference/findings.md), each with a cure:

# %%
summary = process(survey, folder / "labels", Settings())
for kind, count in sorted(summary.findings.items()):
    print(f"{kind}: {count}")

# %% A part of the walk: each circle contains the true position with 95 % probability
frames = pl.read_parquet(folder / "labels" / "trajectory" / "*.parquet")
frames = frames.drop_nulls("x")
part = frames.slice(240, 300)
figure, axes = plt.subplots(figsize=(6, 4))
axes.plot(part["x"], part["y"], color="#0072b2")
every_second = part.select("x", "y", "sigma").gather_every(30)
for x, y, sigma in every_second.iter_rows():
    axes.add_patch(plt.Circle((x, y), 2.45 * sigma, alpha=0.3, linewidth=0))
axes.set(aspect="equal", xlabel="x, m", ylabel="y, m")

# %% [markdown]
# ## Label any other table
#
# A table of anything that you logged on the walk gets positions by its times. Here they are times of the phone's
# clock; for other clocks see [label other sensors](../how-to/other-sensors.md). On the command line: `vislam2tag
# label TABLE --labels labels`.

# %%
times = frames["time_ns"].gather_every(600).head(3)
notes = pl.DataFrame({"time_ns": times, "note": ["door", "window", "stairs"]})
labelled = label(notes, folder / "labels").table
columns = ["note", "x_m", "y_m", "status"]
for note, x, y, status in labelled.select(columns).iter_rows():
    print(f"{note}: {x:.1f} m, {y:.1f} m, {status}")

# %% [markdown]
# ## Map tables in memory
#
# [`map_walk`](../reference/api.md#map_walk) needs no folder. It takes tables from Polars, pandas or Arrow: the
# tracker's poses, the landmarks it saw, and their positions. If you have such tables, they need only the columns below.
# The files of this walk have no header and decimal commas, so read them first:

# %%
pose = ["tx", "ty", "tz", "qx", "qy", "qz", "qw"]


def read(file: str, columns: list[str]) -> pl.DataFrame:
    options = {"separator": ";", "has_header": False, "infer_schema": False}
    texts = pl.read_csv(walk / file, new_columns=columns, **options)
    plain = texts.select(pl.all().str.strip_chars().str.replace(",", "."))
    numbers = dict.fromkeys(pose, pl.Float64)
    return plain.cast({"time_ns": pl.Int64, **numbers})


poses = read("poses.csv", ["time_ns", *pose])
sightings = read("initPoses.csv", ["id", "time_ns", *pose])
landmarks = pl.read_csv(survey / "floor_0" / "marker_dict.csv")

# %% [markdown]
# Then map them and label a table. The positions are in `x` and `y` here, as in the labels of `process`, not in `x_m`
# and `y_m` as in a table of `label`.

# %%
result = vislam2tag.map_walk(poses, sightings, landmarks)
print(result.label(notes).select("note", "x", "y", "status"))

# %% [markdown]
# `process` also uses the walk's `sensors.csv`. For the same positions, pass that table as `sensors`.

# %% [markdown]
# ## If it fails
#
# - **No row has a position**: the walk saw fewer than two landmarks of `marker_dict.csv`. Compare the ids with
#   `vislam2tag inspect survey`.
# - **The path crosses walls**: run `vislam2tag diagnose survey`. It finds swapped and mis-measured landmarks
#   ([how](../how-to/diagnosis.md)).
# - **More symptoms**: [troubleshooting](../help/troubleshooting.md).
#
# ## Next
#
# - [Find what is wrong with a survey](../how-to/diagnosis.md).
# - [How accurate are my labels?](../how-to/evaluate.md)
# - [From labels to a trained model](trained_model.md).
