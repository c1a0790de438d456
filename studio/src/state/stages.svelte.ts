// What is left to do in each view, for badges, and the next task.
import { data } from './data.svelte';
import { openFaults } from './faults.svelte';
import type { Tab } from './choice.svelte';
import { nextTask, waitingOf } from './next';

class Badges {
  private counts = $derived<Partial<Record<Tab, number>>>({
    walks: waitingOf(data.sessions),
    diagnose: openFaults().length,
    corrections: data.corrections.entries.filter(({ findings }) => findings.length).length,
    collect: data.collecting?.refused.length ?? 0,
  });
  next = $derived(data.survey && nextTask(data.survey, data.sessions, data.diagnosis, openFaults().length, data.shared));

  of(views: Tab[]): number {
    return views.reduce((sum, view) => sum + (this.counts[view] ?? 0), 0);
  }
}

export const badges = new Badges();
