// What the last correction changed, shown once the labels of the walks that it touched are made again.
import { data } from './data.svelte';
import { type Summary, summaryOf } from './summary';

class Result {
  /** The walks, how they were before, and the job that processes them again. */
  asked = $state.raw<{ kind: 'change' | 'undo' | 'redo'; job: number; ids: string[]; before: Summary } | null>(null);
  /** All walks before the first correction of this page. */
  first = $state.raw<Summary | null>(null);
  all = $derived(this.first && { before: this.first, after: summaryOf(data.sessions) });
  shown = $derived(this.asked && data.settled >= this.asked.job ? { count: this.asked.ids.length, before: this.asked.before, after: this.of(this.asked.ids) } : null);

  of(ids: string[]): Summary {
    return summaryOf(ids.flatMap((id) => data.byId.get(id) ?? []));
  }
}

export const result = new Result();
