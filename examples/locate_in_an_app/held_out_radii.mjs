// The circles of `local-kriging`: a mixture of the errors on scans left out in several ways.

import { row, rows } from "./model_file.mjs";
import { sum } from "./scans.mjs";

const LEVELS = [...Array.from({ length: 99 }, (_, at) => (at + 1) / 100), 0.995];
const PRIOR_SCANS = 5;
const CORRELATED = 0.5;
const ROUNDS = 30;
const HALVINGS = 12;

/** A function from features and walks of scans to their `{radius68, radius95}`, metres. */
export function heldOutRadii(arrays) {
  const [least, greatest] = rows(arrays.radius_bounds);
  const likeness = rows(arrays.radius_likeness);
  const learned = Array.from(arrays.radius_learned.data, Boolean);
  const of68and95 = [0, 1].map((at) => ({
    lines: likeness.map((_, way) => slab(arrays.radius_line, at, way)),
    beyond: likeness.map((_, way) => slab(arrays.radius_beyond, at, way)),
  }));
  return (features, walks) => {
    const within = features.map((one) => one.map((value, f) => Math.min(Math.max(value, least[f]), greatest[f])));
    const shares = sharesOfWays(within.map((one) => likeness.map((line) => linear(line, one))), walks, learned);
    return within.map((one, at) => {
      const [small, large] = of68and95.map(({ lines, beyond }, which) =>
        mixtureQuantile(shares[at], lines.map((line) => linear(line, one)), beyond, [0.68, 0.95][which]),
      );
      return { radius68: Math.exp(small), radius95: Math.exp(Math.max(small, large)) };
    });
  };
}

/** The numbers [first, second, :] of an array of three axes. */
function slab({ shape, data }, first, second) {
  return row({ shape: [shape[0] * shape[1], shape[2]], data }, first * shape[1] + second);
}

function linear(line, features) {
  return line[0] + sum(features.map((value, f) => value * line[f + 1]));
}

/** The probability of each way for each scan, from logarithms of likelihoods. Scans of a walk share their evidence; scans with an empty walk are alone. */
function sharesOfWays(logs, walks, learned) {
  const members = new Map();
  walks.forEach((walk, at) => members.set(walk || at, [...(members.get(walk || at) ?? []), at]));
  const shares = logs.map((one) => one.map(() => 0));
  const kinds = [true, false].map((kind) => [...learned.keys()].filter((way) => learned[way] === kind));
  for (const scans of members.values()) {
    const [known, strange] = kinds.map((ways) => sum(scans.map((at) => meanLikely(ways.map((way) => logs[at][way])))));
    const evidence = (known - strange) / (1 + (scans.length - 1) * CORRELATED);
    const chance = kinds[0].length && kinds[1].length ? 1 / (1 + Math.exp(-evidence)) : kinds[0].length ? 1 : 0;
    kinds.forEach((ways, kind) => {
      const within = mixture(scans.map((at) => ways.map((way) => logs[at][way])), ways.length);
      scans.forEach((at, i) => ways.forEach((way, w) => (shares[at][way] = (kind ? 1 - chance : chance) * within[i][w])));
    });
  }
  return shares;
}

/** The logarithm of the mean of likelihoods. */
function meanLikely(logs) {
  const most = Math.max(...logs);
  return most + Math.log(sum(logs.map((log) => Math.exp(log - most))) / logs.length);
}

/** The probability of each way of one kind for each scan of a walk. */
function mixture(logs, ways) {
  const likelihoods = logs.map((one) => one.map((log) => Math.exp(log - Math.max(...one))));
  let ofWalk = Array(ways).fill(1 / ways);
  let shares = likelihoods;
  for (let round = 0; round < ROUNDS; round++) {
    shares = likelihoods.map((one) => {
      const weight = one.map((likelihood, way) => likelihood * ofWalk[way]);
      return weight.map((part) => part / sum(weight));
    });
    ofWalk = ofWalk.map((_, way) => (sum(shares.map((one) => one[way])) + PRIOR_SCANS / ways) / (logs.length + PRIOR_SCANS));
  }
  return shares;
}

/** The quantile of the logarithm of the error, found by bisection between those of the ways. */
function mixtureQuantile(shares, at, beyond, wanted) {
  const own = at.map((one, way) => one + interpolated(wanted, LEVELS, beyond[way]));
  let [least, greatest] = [Math.min(...own), Math.max(...own)];
  for (let halving = 0; halving < HALVINGS; halving++) {
    const middle = (least + greatest) / 2;
    const below = sum(shares.map((share, way) => share * probability(middle - at[way], beyond[way])));
    if (below < wanted) least = middle;
    else greatest = middle;
  }
  return greatest;
}

function probability(value, quantiles) {
  if (value < quantiles[0]) return 0;
  if (value > quantiles[quantiles.length - 1]) return 1;
  return interpolated(value, quantiles, LEVELS);
}

/** Values at points `from` (ascending), interpolated linearly to `to`; in a tie the last one counts. */
function interpolated(value, from, to) {
  let at = 0;
  while (at + 1 < from.length && from[at + 1] <= value) at++;
  if (at === from.length - 1 || from[at] === value) return to[at];
  return to[at] + ((to[at + 1] - to[at]) / (from[at + 1] - from[at])) * (value - from[at]);
}
