// What is left to do in each view, for badges, and the next task.
import { data } from './data.svelte';
import { openFaults } from './faults.svelte';
import { readOnly } from '../api/client';
import { type Stage, type Tab, VIEWS } from './choice.svelte';
import { nextTask, waitingOf } from './next';

/** An export only shows. */
const hidden: Tab[] = readOnly ? ['prepare', 'share'] : [];
const isShown = (view: Tab) => !hidden.includes(view) && !(readOnly && view === 'compare' && (data.survey?.outputs.length ?? 0) < 2);

/** The views of a step that there are here. */
export const viewsOf = (stage: Stage): Tab[] => VIEWS[stage].filter(isShown);
export const stageOf = (view: Tab): Stage => (Object.keys(VIEWS) as Stage[]).find((stage) => VIEWS[stage].includes(view)) ?? 'check';
export const shownViews = (): Tab[] => Object.values(VIEWS).flat().filter(isShown);

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
