// What the last correction changed, shown once the labels of the walks that it touched are made again.
import { data } from './data.svelte';
import { type Summary, summaryOf } from './summary';

const kept = () => `${data.survey?.name} before corrections`;

/** What was done with a correction. */
export type Kind = 'change' | 'undo' | 'redo';

class Result {
  /** The walks, how they were before, and the job that processes them again. */
  asked = $state.raw<{ kind: Kind; job: number; ids: string[]; before: Summary } | null>(null);
  private first = $state.raw<Summary | null>(null);
  /** All walks before the first correction of this page, and now. */
  all = $derived.by(() => {
    const before = this.first ?? (JSON.parse(sessionStorage.getItem(kept()) ?? 'null') as Summary | null);
    return before && { before, after: summaryOf(data.sessions) };
  });
  shown = $derived(this.asked && data.settled >= this.asked.job ? { count: this.asked.ids.length, before: this.asked.before, after: this.of(this.asked.ids) } : null);

  /** Keep how all walks are before the first correction, also when the page is loaded again. */
  begin(all: Summary): void {
    if (this.all) return;
    this.first = all;
    sessionStorage.setItem(kept(), JSON.stringify(all));
  }

  of(ids: string[]): Summary {
    return summaryOf(ids.flatMap((id) => data.byId.get(id) ?? []));
  }
}

export const result = new Result();
