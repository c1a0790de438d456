"""What scikit-learn and skops would do instead of our kernel regression, field of levels and trees as arrays.

    vislam2tag import ../shared/data/tampere/tampere-2017-08-21.tar.xz --format tampere --out tampere
    OMP_NUM_THREADS=1 python benchmarks/positioning_libraries.py tampere          (pip install skops, for its line)

Learns from what trains in the official split with both, and prints times (processor seconds) and how far results
differ; docs/results/positioning-settings.md says what follows.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

import numpy as np
from positioning_settings import training_part
from scipy.linalg import cho_solve
from sklearn.ensemble import ExtraTreesRegressor
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern
from sklearn.kernel_approximation import Nystroem
from sklearn.linear_model import Ridge

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.baselines.forest import forest_of
from vislam2tag.positioning.cell_density import level_field
from vislam2tag.positioning.cell_density.density_cells import DensityCells, cells_near
from vislam2tag.positioning.cell_density.kernel_regression import KernelNormalEquations
from vislam2tag.positioning.cell_density.path_loss import PathLoss, fitted_path_loss
from vislam2tag.positioning.cell_density.scan_kernels import DirectionKernel, directions, levels
from vislam2tag.positioning.scans.learning_data import LearningData
from vislam2tag.positioning.scans.representation import augmented

SHARPNESS, WIDTH_M, COPIES = 2.0, 5.0, 4
RIDGES = (1.0, 0.3, 0.1, 0.03)
NOISE_DB = 6.0
_Result = TypeVar("_Result")


def timed(work: Callable[[], _Result]) -> tuple[_Result, float]:
    """Return what ``work`` does and the processor seconds that it took."""
    begun = time.process_time()
    result = work()
    return result, time.process_time() - begun


def kernel_regression(data: LearningData) -> None:
    """Regress onto densities of labels from the scans and augmented copies, with kernels around every scan."""
    level = levels(data.scans)
    cells = cells_near(data.places, 0.8 * WIDTH_M)
    target = cells.label_densities(data.places, WIDTH_M)
    rng, mean = np.random.default_rng(0), target.mean(axis=0)
    blocks = [level, *(augmented(level, rng) for _ in range(COPIES))]

    def ours() -> list[FloatArray]:
        equations = KernelNormalEquations.empty(DirectionKernel(directions(level), SHARPNESS), mean, len(level))
        return [function(level) for function in equations.add((block, target) for block in blocks).solved(RIDGES)]

    def theirs() -> list[FloatArray]:
        kernel = Nystroem(kernel="rbf", gamma=SHARPNESS, n_components=len(level)).fit(directions(level))
        features = kernel.transform(np.concatenate([directions(block) for block in blocks]))
        targets = np.tile(target - mean, (len(blocks), 1))
        fitted = [Ridge(alpha=ridge, fit_intercept=False).fit(features, targets) for ridge in RIDGES]
        return [one.predict(features[: len(level)]) + mean for one in fitted]

    (one, own_s), (other, other_s) = timed(ours), timed(theirs)
    apart = max(float(np.abs(a - b).max()) for a, b in zip(one, other, strict=True))
    print(f"kernel regression, {len(level)} scans, {len(cells)} cells, {len(RIDGES)} ridges")
    print(f"  ours {own_s:.2f} s, Nystroem and Ridge {other_s:.2f} s; densities up to {apart:.4f} apart")
    print(f"  in memory: ours {8e-6 * len(level) ** 2:.0f} MB, theirs {8e-6 * len(blocks) * len(level) ** 2:.0f} MB")


def field(data: LearningData) -> None:
    """Learn the field of levels; scikit-learn's process factors the same matrices, once more for what was not heard."""
    level_dbm, places = data.scans.dense(), data.places
    faintest_dbm = float(np.nanquantile(level_dbm, 0.02))
    path_loss = fitted_path_loss(level_dbm, places, faintest_dbm)
    cells = cells_near(places, 2.0, 6)
    given = level_field._FieldData(level_dbm, places, path_loss, faintest_dbm)
    one, own_s = timed(lambda: level_field._field(given, cells, NOISE_DB))
    (expected, variance), other_s = timed(lambda: field_by_scikit_learn(data, path_loss, cells, faintest_dbm))
    apart = np.abs(one.level_dbm - expected).max(), np.abs(one.variance - variance).max()
    print(f"field of levels, {len(cells)} cells: ours {own_s:.2f} s, GaussianProcessRegressor {other_s:.2f} s")
    print(f"  levels up to {apart[0]:.0e} dB apart, variances up to {apart[1]:.0e} dB^2")


def field_by_scikit_learn(
    data: LearningData, path_loss: PathLoss, cells: DensityCells, faintest_dbm: float
) -> tuple[FloatArray, FloatArray]:
    """Return levels (c, a), dBm, and their variances (c,), dB^2."""
    level_dbm, places = data.scans.dense(), data.places
    expected = path_loss.level_dbm(cells.storey, cells.centre_m)
    variance = np.zeros(len(cells))
    kernel = ConstantKernel(level_field._SHADOW_DB**2) * Matern(level_field._SHADOW_LENGTH_M, nu=0.5)
    for storey in np.unique(places.storey):
        on, cell = places.storey == storey, cells.storey == storey
        xy = places.xy[on]
        process = GaussianProcessRegressor(kernel, alpha=NOISE_DB**2, optimizer=None).fit(xy, np.zeros(len(xy)))
        inverse = cho_solve((process.L_, True), np.eye(len(xy)))
        mean_dbm = path_loss.level_dbm(places.storey[on], xy)
        residual = level_field._residuals(level_dbm[on], mean_dbm, inverse, faintest_dbm)
        _, sigma_db = process.predict(cells.centre_m[cell], return_std=True)
        expected[cell] += process.fit(xy, residual).predict(cells.centre_m[cell])
        variance[cell] = NOISE_DB**2 + sigma_db**2
    return expected, variance


def trees(data: LearningData) -> None:
    """Keep and follow 200 trees."""
    level = levels(data.scans).astype(np.float32)
    grown = ExtraTreesRegressor(200, max_features=0.3, random_state=0).fit(level, data.places.xy)
    forest = forest_of(grown.estimators_)
    own, own_s = timed(lambda: forest.leaves(level))
    other, other_s = timed(lambda: grown.apply(level))
    same = bool((own - forest.root == other).all())
    size = sum(array.nbytes for array in forest.arrays().values())
    print(f"trees: arrays {1e-6 * size:.1f} MB, followed in {own_s:.2f} s; scikit-learn {other_s:.2f} s; same: {same}")
    if find_spec("skops"):
        skops = import_module("skops.io")
        with TemporaryDirectory() as folder:
            files = [Path(folder) / name for name in ("a.skops", "b.skops")]
            for file in files:
                skops.dump(grown, file)
            unknown = skops.get_untrusted_types(file=files[0])
            _, load_s = timed(lambda: skops.load(files[0], trusted=unknown))
            first, second = (file.read_bytes() for file in files)
        print(f"  skops {1e-6 * len(first):.1f} MB, read in {load_s:.2f} s; to be trusted: {', '.join(unknown)};")
        print(f"  the same model gives the same bytes: {first == second}")


def main() -> None:
    """Print the comparisons."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    data = training_part(parser.parse_args().dataset, "official")
    for compare in (kernel_regression, field, trees):
        compare(data)


if __name__ == "__main__":
    main()
