# %% [markdown]
# # Label your own walk
#
# For whoever has recorded a walk, with the phone app or in the published layout, and wants its readings labelled.
#
# A survey is a folder: a table of the floor's size, a table of the landmarks, and a folder for each walk. Here the
# walk's
# files come from the simulator; copy yours in their place ([files of a session](../reference/session-files.md)).

# %%
import shutil
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import polars as pl

import vislam2tag
from vislam2tag.api import Settings, label, process, regular_survey, simulate

folder = Path(tempfile.mkdtemp())
simulate(regular_survey(seed=8, floors=(0,), devices=("LG",), sessions=1, duration_s=120.0), folder / "made")
walk = next((folder / "made" / "floor_0" / "LG").iterdir())

# %% [markdown]
# ## The folder of a survey
#
# Write down how large the plan is and where each landmark hangs: metres, x to the right and y up on the plan
# ([survey landmarks](../how-to/registration.md) tells how to measure them).

# %%
survey = folder / "survey"
(survey / "floor_0" / "LG").mkdir(parents=True)
shutil.copytree(walk, survey / "floor_0" / "LG" / "my_walk")
for table in ("floor_dimensions.csv", "floor_0/marker_dict.csv"):
    shutil.copy(folder / "made" / table, survey / table)
print((survey / "floor_dimensions.csv").read_text())
print("".join((survey / "floor_0" / "marker_dict.csv").read_text().splitlines(keepends=True)[:4]))

# %% [markdown]
# ## Label it
#
# On the command line: `vislam2tag process survey --out labels`, after a look with `vislam2tag inspect survey`. What is
# odd in
# the files is a [finding](../reference/findings.md).

# %%
summary = process(survey, folder / "labels", Settings())
for kind, count in sorted(summary.findings.items()):
    print(f"{kind}: {count}")

# %% The walk; the circles hold the true place with 95 %
frames = pl.read_parquet(folder / "labels" / "trajectory" / "*.parquet").drop_nulls("x")
figure, axes = plt.subplots(figsize=(6, 4))
axes.plot(frames["x"], frames["y"], color="#0072b2")
for x, y, sigma in frames.select("x", "y", "sigma").gather_every(150).iter_rows():
    axes.add_patch(plt.Circle((x, y), 2.45 * sigma, color="#0072b2", alpha=0.2, linewidth=0))
axes.set(aspect="equal", xlabel="x, m", ylabel="y, m")

# %% [markdown]
# ## Any other table
#
# Whatever has times on the phone's clock gets positions, too: `vislam2tag label TABLE --labels labels`.

# %%
times = frames["time_ns"].gather_every(600).head(3)
mine = pl.DataFrame({"time_ns": times, "what": ["door", "window", "stairs"]})
for what, x, y, status in label(mine, folder / "labels").table.select("what", "x_m", "y_m", "status").iter_rows():
    print(f"{what}: {x:.1f} m, {y:.1f} m, {status}")

# %% [markdown]
# ## The same in memory
#
# [`map_walk`](../reference/api.md#map_walk) takes tables instead of folders: from Polars, pandas or Arrow. Its
# positions are those of `process`, which also uses the readings of `sensors.csv`: pass them as `sensors`.

# %%
pose = ["tx", "ty", "tz", "qx", "qy", "qz", "qw"]


def read(file: str, columns: list[str]) -> pl.DataFrame:
    texts = pl.read_csv(walk / file, separator=";", has_header=False, new_columns=columns, infer_schema=False)
    plain = texts.select(pl.all().str.strip_chars().str.replace(",", "."))
    return plain.cast({"time_ns": pl.Int64, **dict.fromkeys(pose, pl.Float64)})


poses = read("poses.csv", ["time_ns", *pose])
sightings = read("initPoses.csv", ["id", "time_ns", *pose])
landmarks = pl.read_csv(survey / "floor_0" / "marker_dict.csv")

result = vislam2tag.map_walk(poses, sightings, landmarks)
print(result)
print(result.label(mine).select("what", "x", "y", "status"))

# %% [markdown]
# ## Next
#
# - [Find what is wrong with a survey](../how-to/diagnosis.md), where labels cannot be right.
# - [Accuracy without truth](../explanation/self-check.md): `vislam2tag check survey`.
# - [From labels to a trained model](trained_model.md).
