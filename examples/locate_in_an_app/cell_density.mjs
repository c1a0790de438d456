// `cell-density`: a density over cells by kernel regression.

import { row, rows } from "./model_file.mjs";
import { softmax } from "./networks.mjs";
import { along, direction, largest, regressedShares, stepCosine, steps, sum } from "./scans.mjs";
import { mean, median } from "./votes.mjs";

const LEAST_DENSITY = 1e-9;
const OFFSET_DB = 4;
const COMPARED = 3;
const PLACED = 5;
const TIE = 1e-7;
const LEAST_EXCESS = 1e-6;
const SMALLEST_SCALE_M = 0.1;

export function cellDensity(_, arrays) {
  const centres = rows(arrays.centre);
  const places = rows(arrays.cell_centre_m);
  const thresholds = Array.from(arrays.storey_threshold.data);
  const counts = centres.map((_, m) => stepsOf(row(arrays.storey_above, m), thresholds.length));
  const [sharpness, half] = [arrays.sharpness.data[0], arrays.half.data[0]];
  return (asked) =>
    asked.map((scan) => {
      const own = direction(scan);
      const cosines = centres.map((centre) => along(own, centre));
      const byDirection = cosines.map((cosine) => Math.exp(2 * sharpness * (cosine - 1)));
      const { density_weight: weight, density_mean: base } = arrays;
      const density = regressedShares(byDirection, weight, base, LEAST_DENSITY, LEAST_DENSITY);
      const count = steps(scan, thresholds);
      const both = cosines.map(
        (cosine, m) => Math.exp(2 * (cosine - 1)) + Math.exp(2 * (stepCosine(count, counts[m]) - 1)),
      );
      const probability = regressedShares(both, arrays.storey_weight, arrays.storey_mean, 0, LEAST_DENSITY);
      const storey = largest(probability);
      const on = density.map((one, c) => (arrays.cell_storey.data[c] === storey ? one : 0));
      const dense = median(on, places);
      const { dispersal, novelty } = compared(cosines, dense, arrays);
      const lengths = places.map(([x, y]) => Math.hypot(x - dense[0], y - dense[1]));
      const apart = sum(density.map((one, c) => one * lengths[c])) / sum(density);
      const share = half === 0 ? 1 : half === Infinity ? 0 : novelty ** 2 / (novelty ** 2 + half ** 2);
      const field = share > 0 ? fieldPlace(scan, storey, arrays) : dense;
      const [x, y] = [0, 1].map((axis) => (1 - share) * dense[axis] + share * field[axis]);
      const stated = radii(Math.sqrt(apart * dispersal), novelty, arrays.radii.data);
      const unlike = novelty > arrays.like.data[0];
      return { storey, probability, x, y, z: arrays.height_m.data[storey], ...stated, unlike };
    });
}

/** The number of thresholds that each access point of a centre exceeds, from `steps`. */
function stepsOf(above, count) {
  const columns = Array.from({ length: above.length / count }, (_, column) => column);
  return { columns, values: columns.map((column) => sum(above.subarray(column * count, (column + 1) * count))) };
}

/** Mean distance of the most similar scans' places from the answer, and the novelty of the scan. */
function compared(cosines, [x, y], { centre_xy: xy, centre_apart: apart }) {
  const distance = cosines.map((cosine) => Math.sqrt(Math.max(2 - 2 * cosine, 0)));
  const nearest = [...distance.keys()].sort((i, j) => distance[i] + TIE * i - (distance[j] + TIE * j)).slice(0, PLACED);
  const dispersal = sum(nearest.map((m) => Math.hypot(xy.data[2 * m] - x, xy.data[2 * m + 1] - y))) / nearest.length;
  const few = nearest.slice(0, COMPARED);
  const unlike = sum(few.map((m) => distance[m])) / few.length;
  const excess = Math.max(unlike - sum(few.map((m) => apart.data[m])) / few.length - LEAST_EXCESS, 0);
  return { dispersal, novelty: excess * unlike };
}

/** The mean place on a storey by the likelihood of levels; if the storey has no cell, on all storeys. */
function fieldPlace({ columns, dbm }, storey, arrays) {
  const { field_storey: on, field_level_dbm: expected, field_variance: variance } = arrays;
  const some = on.data.includes(storey);
  const logs = Array.from(variance.data, (v, c) => {
    if (some && on.data[c] !== storey) return -Infinity;
    const levels = row(expected, c);
    let [total, squares] = [0, 0];
    columns.forEach((column, i) => {
      total += dbm[i] - levels[column];
      squares += (dbm[i] - levels[column]) ** 2;
    });
    const all = v + columns.length * OFFSET_DB ** 2;
    const spread = (columns.length - 1) * Math.log(v) + Math.log(all);
    return -((squares - (OFFSET_DB ** 2 / all) * total ** 2) / v + spread) / 2;
  });
  return mean(softmax(logs), rows(arrays.field_centre_m));
}

/** Circles that grow with the spread of guesses and with the novelty of a scan. */
function radii(spread, novelty, [base, factor68, by68, factor95, by95, mostNovel]) {
  const scale = Math.max(Math.hypot(base, spread), SMALLEST_SCALE_M);
  const fresh = Math.min(novelty, mostNovel);
  return { radius68: scale * (factor68 + by68 * fresh), radius95: scale * (factor95 + by95 * fresh) };
}
