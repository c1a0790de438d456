# %% [markdown]
# # From labels to a trained model
#
# For whoever wants to locate phones by Wi-Fi: a data set of labelled walks, a model that learns from it, and how far
# it errs.
#
# We begin with a survey as in [the first survey](first_steps.md).

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from vislam2tag.api import build_dataset, learning_data, model_named, regular_survey, simulate

folder = Path(tempfile.mkdtemp())
simulate(regular_survey(seed=5, floors=(0,), sessions=2, duration_s=120.0), folder / "survey")

# %% [markdown]
# ## Fingerprints
#
# A *fingerprint* is what one scan heard, with the place where it was taken. On the command line:
# `vislam2tag dataset survey --out fingerprints`.

# %%
dataset = build_dataset(folder / "survey", folder / "fingerprints")
print(f"{dataset.fingerprints.filter(status='ok').collect().height} fingerprints with a position")
print("splits:", ", ".join(sorted(dataset.splits)))

# %% [markdown]
# ## Train, and test on whole walks
#
# The split `trajectory` holds out whole walks: scans of one walk are too much alike to test on its neighbours
# ([splits](../reference/splits.md)). The radius that a model states should hold 68 % of the errors.

# %%
split = dataset.splits["trajectory"]
known, asked = learning_data(dataset).train_test(split, split.info.folds[0])
model = model_named("weighted-knn")
model.fit(known.scans, known.places)
found = model.predict(asked.scans)
error_m = np.linalg.norm(found.xy - asked.places.xy, axis=1)
print(f"{len(known)} fingerprints train, {len(asked)} test")
print(f"median error {np.median(error_m):.1f} m, inside the 68 % radius: {np.mean(error_m <= found.radius_68_m):.0%}")

# %% Errors of the held-out walk: half of them are left of the dashed line
figure, axes = plt.subplots(figsize=(5, 3.5))
axes.plot(np.sort(error_m), np.linspace(0, 1, len(error_m)), color="#0072b2")
axes.axvline(np.median(error_m), linestyle="--", color="#999999")
axes.set(xlabel="error, m", ylabel="share of scans")

# %% [markdown]
# ## Next
#
# - [Positioning models](../explanation/positioning.md), and [how they compare](../how-to/benchmark.md).
# - [Locate scans](../how-to/locate.md) of a file with a trained model.
