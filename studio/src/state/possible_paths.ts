// Paths that a walk may have taken on the plan: which of them are shown, and where it was on each at a moment.
import type { Candidate, PlacedOnPlan } from '../api/model';

/** More lines cannot be distinguished. */
const MOST_SHOWN = 8;
/** Less probable paths are not shown. */
const LEAST_WEIGHT = 0.02;

/** The paths to show, the most probable first, and the probability of all others together. */
export function shownPaths(candidates: Candidate[]): { paths: Candidate[]; rest: number } {
  const paths = candidates.slice(0, MOST_SHOWN).filter(({ weight }, number) => number === 0 || weight >= LEAST_WEIGHT);
  const rest = 1 - paths.reduce((sum, { weight }) => sum + weight, 0);
  return { paths, rest: paths.length ? Math.max(0, rest) : 0 };
}

/** Where a path was at a moment: between its points, which it passes at the times `t` (ascending), in a straight line. */
export function placeAt(t: number[], points: Candidate['points'], time: number): [number, number] {
  const after = t.findIndex((other) => other > time);
  if (after < 0) return [...points[points.length - 1]];
  if (after === 0) return [...points[0]];
  const share = (time - t[after - 1]) / (t[after] - t[after - 1]);
  const [[x0, y0], [x1, y1]] = [points[after - 1], points[after]];
  return [x0 + share * (x1 - x0), y0 + share * (y1 - y0)];
}

/** When to tap: as the server says, or, if the taps at these times were not enough, as far from them as possible; null: never. */
export function momentToTap({ tap_s, reason, t }: Pick<PlacedOnPlan, 'tap_s' | 'reason' | 't'>, taps: number[]): number | null {
  if (tap_s !== null) return tap_s;
  if (reason === 'ok' || reason === 'fits_nowhere' || !t.length) return null;
  const away = (time: number) => Math.min(...taps.map((tap) => Math.abs(tap - time)));
  return taps.length ? t.reduce((best, time) => (away(time) > away(best) ? time : best)) : t[Math.floor(t.length / 2)];
}
