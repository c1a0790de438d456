// `weighted-knn`: the nearest learned scans vote.

import { learnedScans, positive, sum, vector } from "./scans.mjs";
import { voted, withRadii } from "./votes.mjs";

const NEAREST = 1e-3;
const LEVEL = {
  positive,
  powed: (dbm) => positive(dbm) ** Math.E,
  exponential: (dbm) => (positive(dbm) > 0 ? Math.exp(Math.min(dbm, 0) / 24) : 0),
};
const DISTANCE = {
  euclidean: (one, other, both) => Math.sqrt(Math.max(one + other - 2 * both, 0)),
  sorensen: (one, other, both) => 1 - (one + other > 0 ? both / ((one + other) / 2) : 0),
  cosine: (one, other, both) => 1 - (one * other > 0 ? both / Math.sqrt(one * other) : 0),
};

/** Returns a function from a scan to its k nearest learned ones: `{index, away}`, the nearest first. */
export function nearestOf(scans, k, distance, levelOf) {
  const [sizeOf, shared] =
    distance === "sorensen" ? [(value) => value, Math.min] : [(value) => value * value, (one, other) => one * other];
  const heardBy = new Map(); // of each access point, who heard it and how loud
  const sizes = scans.map((scan, at) => {
    const { columns, values } = vector(scan, levelOf);
    columns.forEach((column, i) => {
      if (!heardBy.has(column)) heardBy.set(column, []);
      heardBy.get(column).push([at, values[i]]);
    });
    return sum(values.map(sizeOf));
  });
  return (scan) => {
    const { columns, values } = vector(scan, levelOf);
    const both = new Float64Array(scans.length);
    columns.forEach((column, i) => {
      for (const [at, level] of heardBy.get(column) ?? []) both[at] += shared(values[i], level);
    });
    const size = sum(values.map(sizeOf));
    const away = both.map((one, at) => DISTANCE[distance](size, sizes[at], one));
    const index = Array.from(away.keys()).sort((i, j) => away[i] - away[j] || i - j).slice(0, k);
    return { index, away: index.map((at) => away[at]) };
  };
}

export function neighbours({ storeys, parameters }, arrays) {
  const { k, distance, representation, exponent } = parameters;
  const nearest = nearestOf(learnedScans(arrays), k, distance, LEVEL[representation]);
  return (asked) =>
    asked.map((scan) => {
      const { index, away } = nearest(scan);
      const weight = away.map((one) => (Math.max(away[0], NEAREST) / Math.max(one, NEAREST)) ** exponent);
      const answer = withRadii(voted({ index, weight }, arrays, storeys.length), arrays.radii.data);
      return { ...answer, unlike: away[0] > (arrays.like?.data[0] ?? Infinity) };
    });
}
