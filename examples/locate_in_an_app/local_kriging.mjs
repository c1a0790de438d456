// `local-kriging`: the nearest learned scans, weighted by kriging.

import { nearestOf } from "./neighbours.mjs";
import { common, direction, learnedScans, positive, regressedShares, stepCosine, steps, sum } from "./scans.mjs";
import { heldOutRadii } from "./held_out_radii.mjs";
import { median, voted } from "./votes.mjs";

const RIDGE = 0.3;
const REACH = 0.1;
const LEAST_WEIGHT = 1e-6;
const STOREY_REGRESSION = 2;
const LEAST_SPREAD_M = 0.5;
const LEAST_AWAY = 0.01;
const NEAREST = 2;
const QUARTILES = [0.25, 0.5, 0.75];

export function localKriging({ storeys, parameters }, arrays) {
  const scans = learnedScans(arrays);
  const exponent = arrays.exponent.data[0];
  const nearest = nearestOf(scans, parameters.k, "sorensen", (dbm) => positive(dbm) ** exponent);
  const storeyShares = storeyRegression(scans, arrays);
  const radii = heldOutRadii(arrays);
  return (asked) => {
    const found = asked.map((scan) => {
      const { index, away } = nearest(scan);
      const own = direction(scan);
      const weight = krigingWeights(own, index.map((at) => direction(scans[at])), away);
      const further = storeyShares(scan, own).map((share) => STOREY_REGRESSION * share);
      const answer = voted({ index, weight }, arrays, storeys.length, median, further);
      return { ...answer, features: features(answer, away) };
    });
    const stated = radii(found.map((one) => one.features), asked.map((scan) => scan.session));
    return found.map((one, at) => ({ ...one, ...stated[at], unlike: one.features[NEAREST] > arrays.like.data[0] }));
  };
}

/** Features of the error: spread of the votes, ambiguity of the storey, novelty of the scan. */
function features({ spread, torn }, away) {
  const unlike = [1, 10, away.length].map((count) => {
    const some = away.slice(0, count);
    return Math.log(sum(some) / some.length + LEAST_AWAY);
  });
  return [Math.log(Math.max(spread, LEAST_SPREAD_M)), torn, ...unlike];
}

/** Ordinary kriging: weights with sum 1 (before negative ones are removed); repeated scans count less, an equal scan most. */
function krigingWeights(own, near, away) {
  const kernel = (one, other) => Math.exp(2 * (common(one, other) - 1));
  const among = near.map((one, i) => near.map((other, j) => kernel(one, other) + (i === j ? RIDGE : 0)));
  const factor = cholesky(among);
  const simple = solved(factor, near.map((one, i) => kernel(one, own) + RIDGE * Math.exp(-away[i] / REACH)));
  const one = solved(factor, near.map(() => 1));
  const missing = (1 - sum(simple)) / sum(one);
  return simple.map((value, i) => Math.max(value + missing * one[i], LEAST_WEIGHT));
}

/** The lower triangle L with L L' = matrix. */
function cholesky(matrix) {
  const factor = matrix.map((row) => row.map(() => 0));
  for (let i = 0; i < matrix.length; i++) {
    for (let j = 0; j <= i; j++) {
      let rest = matrix[i][j];
      for (let k = 0; k < j; k++) rest -= factor[i][k] * factor[j][k];
      factor[i][j] = i === j ? Math.sqrt(rest) : rest / factor[j][j];
    }
  }
  return factor;
}

/** The solution of L L' x = right. */
function solved(factor, right) {
  const x = [...right];
  for (let i = 0; i < x.length; i++) {
    for (let k = 0; k < i; k++) x[i] -= factor[i][k] * x[k];
    x[i] /= factor[i][i];
  }
  for (let i = x.length - 1; i >= 0; i--) {
    for (let k = i + 1; k < x.length; k++) x[i] -= factor[k][i] * x[k];
    x[i] /= factor[i][i];
  }
  return x;
}

/** Returns a function from a scan and its direction to shares of storeys, by a regression that some learned scans span. */
function storeyRegression(scans, { storey_centre: centre, storey_weight: weight, storey_mean: mean }) {
  const centres = Array.from(centre.data, (at) => scans[at]);
  const heard = centres.flatMap((scan) => Array.from(scan.dbm, positive)).filter((level) => level > 0);
  const thresholds = [0, ...(heard.length ? quantiles(heard.sort((a, b) => a - b), QUARTILES) : [])];
  const directions = centres.map((scan) => direction(scan));
  const counts = centres.map((scan) => steps(scan, thresholds));
  return (scan, own) => {
    const count = steps(scan, thresholds);
    const kernel = directions.map(
      (one, m) => Math.exp(2 * (common(own, one) - 1)) + Math.exp(2 * (stepCosine(count, counts[m]) - 1)),
    );
    return regressedShares(kernel, weight, mean, 0, LEAST_WEIGHT);
  };
}

/** Quantiles of ascending numbers, linear between them. */
function quantiles(ascending, shares) {
  return shares.map((share) => {
    const at = share * (ascending.length - 1);
    const [low, high] = [ascending[Math.floor(at)], ascending[Math.ceil(at)]];
    return low + (high - low) * (at - Math.floor(at));
  });
}
