// Faults of the last search that are still to be answered.
import type { Fault } from '../api/model';
import { data } from './data.svelte';
import { isWritten } from './editing.svelte';

/** What is not corrected yet: labels and diagnosis follow corrections only after a while. */
export const openFaults = (): Fault[] => (data.diagnosis?.faults ?? []).filter(({ changes }) => !changes.length || !changes.every(isWritten));
