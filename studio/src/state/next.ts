// What is to be done next with a survey, from what there is of it.
import type { Diagnosis, Session, Shared, Survey } from '../api/model';
import type { Tab } from './choice.svelte';

export type Task = 'plan' | 'landmarks' | 'collect' | 'process' | 'search' | 'correct' | 'dataset' | 'share';

/** The view in which each task is done. */
export const VIEW_OF: Record<Task, Tab> = { plan: 'prepare', landmarks: 'prepare', collect: 'collect', process: 'walks', search: 'diagnose', correct: 'diagnose', dataset: 'radio', share: 'share' };

/** Walks without labels, or with outdated ones, that can be processed. */
export const waitingOf = (sessions: Session[]): number => sessions.filter(({ stale, error }) => stale || error !== null).length;

/** The first task that is not done; null: all are, or what would tell is not loaded yet. */
export function nextTask(survey: Survey, sessions: Session[], diagnosis: Diagnosis | null, openFaults: number, shared: Shared | null): Task | null {
  if (!sessions.length) return !survey.floors.length ? 'plan' : !survey.landmarks.length ? 'landmarks' : 'collect';
  if (sessions.some(({ stale }) => stale)) return 'process';
  if (openFaults) return 'correct';
  if (!diagnosis || !shared) return null;
  if (diagnosis.state !== 'full') return 'search';
  if (!shared.dataset || shared.dataset.stale) return 'dataset';
  return !shared.page || shared.page.stale ? 'share' : null;
}
