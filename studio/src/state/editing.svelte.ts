// Corrections: shown as lines before they are saved, each undone and redone alone, labels made again after each.
import * as api from '../api/client';
import type { Change, Conflict, Preview } from '../api/model';
import { t } from '../words/words.svelte';
import { attempt, data } from './data.svelte';
import { type Kind, result } from './result.svelte';
import { type Summary, summaryOf } from './summary';

/** A change of the file that this page saved, or took back: the text before it and after it. */
interface Step {
  before: string;
  after: string;
  /** The walks whose labels it changes. */
  touched: string[];
}

class Editing {
  private awaited = $state(0);
  /** Whether an answer about corrections is awaited: forms wait, and the second of two clicks does nothing. */
  busy = $derived(this.awaited > 0);
  /** What would be saved; null: nothing is being corrected. */
  preview = $state.raw<Preview | null>(null);
  past = $state.raw<Step[]>([]);
  future = $state.raw<Step[]>([]);
  /** What someone else changed in the same place, so that a change was not applied. */
  conflicts = $state.raw<{ kind: Kind; found: Conflict[] } | null>(null);
  /** To be done once what is shown is saved. */
  saved: () => void = () => {};
  private last: Promise<unknown> = Promise.resolve();

  /** Do one thing after the other: keys are pressed faster than files are written. */
  inTurn(work: () => Promise<void>): Promise<unknown> {
    this.awaited++;
    return (this.last = this.last.then(work).finally(() => this.awaited--));
  }

  /** Do nothing while an answer is awaited, because what is shown may change with it. */
  alone = (work: () => Promise<void>): Promise<unknown> => (this.busy ? Promise.resolve() : this.inTurn(work));
}

export const editing = new Editing();

/** Show what changes of the file that the page knows would write; `saved` is called once it is written. */
export const propose = (changes: Change[], saved?: () => void) => show({ base: data.corrections.text, text: null, changes }, saved);

/** Show what another text, made from `base`, would change in the file. */
export const proposeText = (text: string, base: string, saved: () => void) => show({ base, text, changes: [] }, saved);

type Wish = Parameters<typeof api.preview>[0];

const show = (wish: Wish, saved: () => void = () => {}) =>
  editing.alone(async () => {
    [editing.preview, editing.saved] = [await look(wish), saved];
  });

/** Write what is shown. */
export const accept = () =>
  editing.alone(async () => {
    if (editing.preview) await write(editing.preview, editing.saved);
    editing.preview = null;
  });

/** Write changes without showing them first. */
export const correctAtOnce = (changes: Change[], saved: () => void = () => {}) =>
  editing.alone(async () => {
    const preview = await look({ base: data.corrections.text, text: null, changes });
    if (preview) await write(preview, saved);
  });

async function look(wish: Wish): Promise<Preview | null> {
  let found: Preview | null = null;
  await attempt(() =>
    noting('change', async () => {
      found = await api.preview(wish);
    }),
  );
  return found;
}

/** Write a change, and map again what it touches. */
async function write(preview: Preview, saved: () => void): Promise<void> {
  const before = result.of(preview.touched);
  await attempt(async () => {
    const all = summaryOf(data.sessions);
    data.corrections = await api.save(preview.text, preview.version);
    result.begin(all);
    [editing.past, editing.future] = [[...editing.past, { before: preview.before, after: preview.text, touched: preview.touched }], []];
    saved();
    if (preview.touched.length) await mapAgain('change', preview.touched, preview.touched, before);
    else [data.notice, result.asked] = [t('change.kept'), null];
  });
}

export const undo = () => editing.inTurn(() => takeBack('undo', editing.past, (past, redone) => ([editing.past, editing.future] = [past, [...editing.future, redone]])));
export const redo = () => editing.inTurn(() => takeBack('redo', editing.future, (future, undone) => ([editing.past, editing.future] = [[...editing.past, undone], future])));

/** Take the last of some steps back in the file as it is now; `done` hears of the others and of the step that reverses it. */
async function takeBack(kind: 'undo' | 'redo', steps: Step[], done: (left: Step[], reverse: Step) => void): Promise<void> {
  const step = steps.at(-1);
  if (!step) return;
  const { touched } = step;
  const results = result.of(touched);
  await attempt(() =>
    noting(
      kind,
      async () => {
        const { before, corrections } = await api.undo({ before: step.before, after: step.after });
        data.corrections = corrections;
        done(steps.slice(0, -1), { before, after: corrections.text, touched });
        await mapAgain(kind, null, touched, results);
      },
      () => (kind === 'undo' ? (editing.past = steps.slice(0, -1)) : (editing.future = steps.slice(0, -1))),
    ),
  );
}

/** Show conflicts in a dialog of their own. */
async function noting(kind: Kind, work: () => Promise<void>, conflict: () => void = () => {}): Promise<void> {
  try {
    await work();
  } catch (error) {
    if (!(error instanceof api.Refusal) || error.problem.code !== 'conflict') throw error;
    if (error.problem.corrections) data.corrections = error.problem.corrections;
    editing.conflicts = { kind, found: error.problem.conflicts };
    conflict();
  }
}

/** Make labels again, of all walks that need it without `sessions`; how those that are `touched` were `before` is compared with the new ones. */
async function mapAgain(kind: Kind, sessions: string[] | null, touched: string[], before: Summary): Promise<void> {
  [data.notice, result.asked] = [t('change.saved'), null];
  const { id } = await api.process(sessions);
  if (touched.length) result.asked = { kind, job: id, ids: touched, before };
}
