# %% [markdown]
# # From labels to a trained model
#
# A trained model estimates where a Wi-Fi scan was taken. You build a data set of labelled walks, train a model, and
# measure its error on a walk that it has not seen. The walks are generated. [Install](../how-to/install.md) the program
# with `[all]`.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from vislam2tag.api import (
    build_dataset,
    learning_data,
    model_named,
    regular_survey,
    simulate,
)

folder = Path(tempfile.mkdtemp())
plan = regular_survey(seed=5, floors=(0,), sessions=2, duration_s=120.0)
simulate(plan, folder / "survey")

# %% [markdown]
# ## Build a data set
#
# A *fingerprint* is one Wi-Fi scan with its position: the access points and their signal strengths. On the command
# line: `vislam2tag dataset survey --out fingerprints`.

# %%
dataset = build_dataset(folder / "survey", folder / "fingerprints")
labelled = dataset.fingerprints.filter(status="ok").collect()
print(labelled.height, "fingerprints with a position")
print("splits:", ", ".join(sorted(dataset.splits)))

# %% [markdown]
# ## Choose a split
#
# A split divides the fingerprints into a training set and a test set. Take `trajectory`, which puts whole walks into
# the test set. With `random`, the test set contains scans that were taken seconds after scans of the training set.
# The error would then look much too small ([splits](../reference/splits.md)).

# %%
split = dataset.splits["trajectory"]
training, test = learning_data(dataset).train_test(split, split.info.folds[0])
print(f"training set: {len(training)} fingerprints, test set: {len(test)}")

# %% [markdown]
# ## Train and test
#
# Each answer has two radii. The true position should be inside the first for 68 % of the scans, and inside the second
# for 95 %.

# %%
model = model_named("weighted-knn")
model.fit(training.scans, training.places)
found = model.predict(test.scans)
error_m = np.linalg.norm(found.xy - test.places.xy, axis=1)
print(f"median error {np.median(error_m):.1f} m")
print(f"inside the 68 % radius: {np.mean(error_m <= found.radius_68_m):.0%}")

# %% Errors on the walk that the model has not seen: half of them are left of the dashed line
figure, axes = plt.subplots(figsize=(5, 3.5))
axes.plot(np.sort(error_m), np.linspace(0, 1, len(error_m)), color="#0072b2")
axes.axvline(np.median(error_m), linestyle="--", color="#999999")
axes.set(xlabel="error, m", ylabel="share of scans")

# %% [markdown]
# More than 68 % are inside: on this small data set the model states radii that are too large.
#
# ## On the command line
#
# In an empty folder, train the model on a generated survey of two floors. `--split` also tests it on walks that it has
# not seen; leave it out to learn from all walks:
#
# ```sh
# vislam2tag simulate survey
# vislam2tag dataset survey --out fingerprints
# vislam2tag train fingerprints --model weighted-knn \
#     --split trajectory --fold test_1 --out building.v2t
# ```
#
# ```text
# tested on 67 fingerprints: mean error 2.07 m, median 1.24 m, ...
# ```
#
# Without `--model`, `train` compares several models and keeps the best, which takes minutes. To locate a scan, save its
# readings as `scans.csv`:
#
# ```text
# scan_id,bssid,rssi_dbm
# s1,02:86:35:f5:61:ea,-58
# s1,02:e6:29:e2:4c:dc,-60
# s1,02:0c:ca:ee:fd:35,-67
# s1,02:d3:b5:29:61:5b,-72
# ```
#
# ```sh
# vislam2tag locate building.v2t scans.csv
# ```
#
# ```text
# scan_id,status,building,floor,floor_name,room,x,y,z,radius_68_m,radius_95_m,...
# s1,ok,,0,,,39.366,26.666,,5.104,29.593,1.0
# ```
#
# ## Next
#
# - [Choose a positioning model](../how-to/which-model.md).
# - [Compare models](../how-to/benchmark.md) on your data or on public data sets.
# - [Locate scans](../how-to/locate.md): file formats, a server, and an app.
