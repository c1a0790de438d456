// Corrections: shown as lines before they are saved, each undone and redone alone, labels made again after each.
import * as api from '../api/client';
import type { Change, Conflict, Preview } from '../api/model';
import { t } from '../words/words.svelte';
import { attempt, data } from './data.svelte';

/** A change of the file that this page saved, or took back: the text before it and after it. */
interface Step {
  before: string;
  after: string;
}

class Editing {
  /** What would be saved; null: nothing is being corrected. */
  preview = $state.raw<Preview | null>(null);
  past = $state.raw<Step[]>([]);
  future = $state.raw<Step[]>([]);
  /** What someone else changed in the same place, so that a change was not applied. */
  conflicts = $state.raw<{ kind: 'change' | 'undo' | 'redo'; found: Conflict[] } | null>(null);
  /** To be done once what is shown is saved. */
  saved: () => void = () => {};
}

export const editing = new Editing();

/** Show what changes of the file that the page knows would write; `saved` is called once it is written. */
export const propose = (changes: Change[], saved: () => void = () => {}) => look({ base: data.corrections.text, text: null, changes }, saved);

/** Show what another text, made from `base`, would change in the file. */
export const proposeText = (text: string, base: string, saved: () => void) => look({ base, text, changes: [] }, saved);

async function look(wish: { base: string; text: string | null; changes: Change[] }, saved: () => void): Promise<void> {
  editing.preview = null;
  await attempt(() =>
    noting('change', async () => {
      [editing.preview, editing.saved] = [await api.preview(wish), saved];
    }),
  );
}

/** Write what is shown, and map again what it touches. */
export async function accept(): Promise<void> {
  const { preview, saved } = editing;
  if (!preview) return;
  await attempt(async () => {
    data.corrections = await api.save(preview.text, preview.version);
    [editing.past, editing.future] = [[...editing.past, { before: preview.before, after: preview.text }], []];
    saved();
    await mapAgain(preview.touched);
  });
  editing.preview = null;
}

/** Tell whether an entry to add is in the file already. */
export function isWritten(change: Change): boolean {
  if (change.action !== 'add') return false;
  return data.corrections.entries.some(
    ({ table, values }) =>
      table === change.table && Object.entries(change.values).every(([name, value]) => JSON.stringify(values[name]) === JSON.stringify(value)),
  );
}

export async function correctAtOnce(changes: Change[], saved: () => void = () => {}): Promise<void> {
  await propose(changes, saved);
  await accept();
}

let working: Promise<unknown> = Promise.resolve();
/** One after the other: keys are pressed faster than files are written. */
const inTurn = (work: () => Promise<unknown>) => (working = working.then(work));

export const undo = () => inTurn(() => takeBack('undo', editing.past, (past, redone) => ([editing.past, editing.future] = [past, [...editing.future, redone]])));
export const redo = () => inTurn(() => takeBack('redo', editing.future, (future, undone) => ([editing.past, editing.future] = [[...editing.past, undone], future])));

/** Take the last of some steps back in the file as it is now; `done` hears of the others and of the step that reverses it. */
async function takeBack(kind: 'undo' | 'redo', steps: Step[], done: (left: Step[], reverse: Step) => void): Promise<void> {
  const step = steps.at(-1);
  if (!step) return;
  await attempt(() =>
    noting(
      kind,
      async () => {
        const { before, corrections } = await api.undo(step);
        data.corrections = corrections;
        done(steps.slice(0, -1), { before, after: corrections.text });
        await mapAgain(null);
      },
      () => (kind === 'undo' ? (editing.past = steps.slice(0, -1)) : (editing.future = steps.slice(0, -1))),
    ),
  );
}

/** Show conflicts in a dialog of their own. */
async function noting(kind: 'change' | 'undo' | 'redo', work: () => Promise<void>, conflict: () => void = () => {}): Promise<void> {
  try {
    await work();
  } catch (error) {
    if (!(error instanceof api.Refusal) || error.problem.code !== 'conflict') throw error;
    if (error.problem.corrections) data.corrections = error.problem.corrections;
    editing.conflicts = { kind, found: error.problem.conflicts };
    conflict();
  }
}

async function mapAgain(sessions: string[] | null): Promise<void> {
  data.notice = t('change.saved');
  await api.process(sessions);
}
