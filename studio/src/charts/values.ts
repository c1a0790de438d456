import type { Series } from '../api/arrow';
import { rowAt } from '../state/walk.svelte';
import { number } from '../words/words.svelte';

/** The value of a chart at a moment, as text. */
export const valueAt = ({ t, v }: Series, time: number): string => number(v[rowAt(t, time)], 2);

const STEPS_S = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600];

/** Times of the axis from 0 to the end (s), at round steps: about `most` at most. */
export function timeTicks(end: number, most: number): number[] {
  const step = STEPS_S.find((each) => end / each <= most) ?? STEPS_S[STEPS_S.length - 1];
  return Array.from({ length: Math.floor(end / step) + 1 }, (_, place) => place * step);
}
