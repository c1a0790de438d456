# %% [markdown]
# # A strategy of your own
#
# For whoever has a better idea how to map a walk: write it, compare it, make it a plug-in.
#
# A strategy sees arrays and no files: the camera's track, the log of landmarks, and where landmarks hang. It gives
# each frame
# a position or a [status](../reference/statuses.md). The whole of `examples/plugin` is such a package.
#
# ## The idea
#
# One similarity (a turn, a shift and a scale) for the whole walk, from where each landmark was logged first. It is a
# poor
# idea, as we shall see.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from vislam2tag.api import open_survey, read_session, regular_survey, simulate, strategy_named
from vislam2tag.core.status import Status
from vislam2tag.core.transforms import Similarity2
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import TrajectoryBuilder, register, surveyed_rows


class FirstSighting:
    """Maps all frames by one transformation."""

    needs = "two landmarks seen"

    def map(self, camera, log, landmarks):
        """Map all frames, or none where fewer than two landmarks were seen."""
        log = surveyed_rows(log, landmarks)
        first = log.plane_acs[log.offsets[:-1]]
        surveyed = landmarks.position_bcs[[landmarks.index[name] for name in log.ids]].reshape(-1, 2)
        builder = TrajectoryBuilder.blank(camera, Status.NO_MAPPING)
        if len(np.unique(first, axis=0)) >= 2:
            builder.map_stretch(camera, 0, len(camera.time_ns), Similarity2.fit(first, surveyed))
        return builder.finish(camera, (), ())


register("first-sighting-tutorial", lambda settings: FirstSighting())

# %% [markdown]
# ## Compare
#
# The simulator knows the truth. `vislam2tag evaluate --strategy NAME` does the same for a whole survey, with intervals.

# %%
folder = Path(tempfile.mkdtemp())
simulate(regular_survey(seed=3, floors=(0,), devices=("LG",), sessions=1, duration_s=120.0), folder)
survey = open_survey(folder)
session = read_session(survey.sessions[0])
truth = np.genfromtxt(next(folder.glob("floor_0/LG/*/truth.csv")), delimiter=",", names=True)
mapped = {}
for name in ("first-sighting-tutorial", "global", "smoother"):
    trajectory = strategy_named(name, MappingSettings()).map(session.camera, session.landmarks, survey.site.landmarks)
    x, y = (np.interp(trajectory.time_ns, truth["time_ns"], truth[axis]) for axis in "xy")
    mapped[name] = trajectory.position_bcs
    print(f"{name}: mean error {np.nanmean(np.hypot(mapped[name][:, 0] - x, mapped[name][:, 1] - y)):.2f} m")

# %% The same walk by our strategy, by the smoother, and as it was
figure, axes = plt.subplots(figsize=(6, 4))
axes.plot(truth["x"], truth["y"], color="#999999", linewidth=4, label="truth")
axes.plot(*mapped["first-sighting-tutorial"][:, :2].T, color="#d55e00", label="ours")
axes.plot(*mapped["smoother"][:, :2].T, color="#0072b2", label="smoother")
axes.set(aspect="equal", xlabel="x, m", ylabel="y, m")
axes.legend()

# %% [markdown]
# ## Make it a plug-in
#
# Put the class into a module of a package of your own, end the module with `register(...)`, and name it in
# `pyproject.toml`:
#
# ```toml
# [project.entry-points."vislam2tag.strategies"]
# first-sighting = "vislam2tag_example.first_sighting"
# ```
#
# Once it is installed (`pip install examples/plugin`), `vislam2tag process survey --out labels --strategy
# first-sighting` has it,
# and so has `evaluate`. [Add a format, strategy, model or command](../project/adding.md) tells what else can be added.
