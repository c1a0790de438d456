// What the last correction changed, shown once the labels of the walks that it touched are made again.
import { data } from './data.svelte';
import { type Summary, summaryOf } from './summary';

class Result {
  /** The walks, how they were before, and the job that processes them again. */
  asked = $state.raw<{ kind: 'change' | 'undo' | 'redo'; job: number; ids: string[]; before: Summary } | null>(null);
  shown = $derived(this.asked && data.settled >= this.asked.job ? { count: this.asked.ids.length, before: this.asked.before, after: this.of(this.asked.ids) } : null);

  of(ids: string[]): Summary {
    return summaryOf(ids.flatMap((id) => data.byId.get(id) ?? []));
  }
}

export const result = new Result();
