import type { Series } from '../api/arrow';
import { rowAt } from '../state/walk.svelte';
import { number } from '../words/words.svelte';

/** The value of a chart at a moment, as text. */
export const valueAt = ({ t, v }: Series, time: number): string => number(v[rowAt(t, time)], 2);
