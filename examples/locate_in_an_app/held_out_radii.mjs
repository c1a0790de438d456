// The circles of `local-kriging`: the mixture of what it erred on scans left out in several ways.

import { row, rows } from "./model_file.mjs";
import { sum } from "./scans.mjs";

const LEVELS = [...Array.from({ length: 99 }, (_, at) => (at + 1) / 100), 0.995];
const PRIOR_SCANS = 5;
const ROUNDS = 30;
const HALVINGS = 12;

/** A function from features and walks of scans to their `{radius68, radius95}`, metres. */
export function heldOutRadii(arrays) {
  const [least, greatest] = rows(arrays.radius_bounds);
  const likeness = rows(arrays.radius_likeness);
  const ways = likeness.length;
  const of68and95 = [0, 1].map((at) => ({
    lines: likeness.map((_, way) => slab(arrays.radius_line, at, way)),
    beyond: likeness.map((_, way) => slab(arrays.radius_beyond, at, way)),
  }));
  return (features, walks) => {
    const within = features.map((one) => one.map((value, f) => Math.min(Math.max(value, least[f]), greatest[f])));
    const shares = sharesOfWays(within.map((one) => likely(likeness, one)), walks, ways);
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

function likely(likeness, features) {
  const logs = likeness.map((line) => linear(line, features));
  return logs.map((log) => Math.exp(log - Math.max(...logs)));
}

/** How probable each way is for each scan; the scans of a walk (an empty one: alone) tell it together. */
function sharesOfWays(likelihoods, walks, ways) {
  const members = new Map();
  walks.forEach((walk, at) => members.set(walk || at, [...(members.get(walk || at) ?? []), at]));
  const shares = [];
  for (const scans of members.values()) {
    let ofWalk = Array(ways).fill(1 / ways);
    for (let round = 0; round < ROUNDS; round++) {
      for (const at of scans) {
        const weight = likelihoods[at].map((one, way) => one * ofWalk[way]);
        shares[at] = weight.map((one) => one / sum(weight));
      }
      ofWalk = ofWalk.map(
        (_, way) => (sum(scans.map((at) => shares[at][way])) + PRIOR_SCANS / ways) / (scans.length + PRIOR_SCANS),
      );
    }
  }
  return shares;
}

/** What the logarithm of the error is below with a probability, found by halving between the ways' own. */
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

/** Values at points `from` (ascending) taken linearly to `to`; of equal points the last. */
function interpolated(value, from, to) {
  let at = 0;
  while (at + 1 < from.length && from[at + 1] <= value) at++;
  if (at === from.length - 1 || from[at] === value) return to[at];
  return to[at] + ((to[at + 1] - to[at]) / (from[at + 1] - from[at])) * (value - from[at]);
}
