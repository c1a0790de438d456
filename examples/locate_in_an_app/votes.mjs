// Places that vote for the place of a scan. Votes are {index, weight}: indices of places, and their weights.

import { largest, sum } from "./scans.mjs";

const MEDIAN_STEPS = 12;
const SMOOTH_M = 1;

/** Mean of places [x, y] by weights. */
export function mean(weights, places) {
  const total = sum(weights);
  return [0, 1].map((axis) => sum(places.map((place, at) => weights[at] * place[axis])) / total);
}

/** Geometric median of places by weights, by Weiszfeld's steps from the mean. */
export function median(weights, places) {
  let at = mean(weights, places);
  for (let step = 0; step < MEDIAN_STEPS; step++) {
    const pull = places.map(([x, y], i) => weights[i] / Math.sqrt((x - at[0]) ** 2 + (y - at[1]) ** 2 + SMOOTH_M ** 2));
    at = mean(pull, places);
  }
  return at;
}

/** First the storey with the most votes (plus `further`), then the `centre` of the places on it. `torn`: share of votes for other storeys. */
export function voted({ index, weight }, { storey, xy, z }, storeys, centre = mean, further = null) {
  const all = sum(weight);
  const share = weight.map((one) => one / all);
  let probability = Array.from({ length: storeys }, (_, s) => sum(share.filter((_, i) => storey.data[index[i]] === s)));
  const torn = 1 - Math.max(...probability);
  if (further) {
    const both = probability.map((one, s) => one + further[s]);
    probability = both.map((one) => one / sum(both));
  }
  const chosen = largest(probability);
  let here = share.map((one, i) => (storey.data[index[i]] === chosen ? one : 0));
  if (sum(here) === 0) here = share;
  const places = Array.from(index, (at) => [xy.data[2 * at], xy.data[2 * at + 1]]);
  const [x, y] = centre(here, places);
  const known = here.map((one, i) => (Number.isNaN(z.data[index[i]]) ? 0 : one));
  const height = sum(known.map((one, i) => (one ? one * z.data[index[i]] : 0))) / sum(known);
  const spread = Math.sqrt(sum(share.map((one, i) => one * ((places[i][0] - x) ** 2 + (places[i][1] - y) ** 2))));
  return { storey: chosen, probability, x, y, z: height, spread, torn };
}

/** Circles that grow with the spread of the guesses. */
export function withRadii(answer, [base, factor68, factor95]) {
  const scale = Math.max(Math.hypot(base, answer.spread), 0.1);
  return { ...answer, radius68: factor68 * scale, radius95: factor95 * scale };
}
