// Corrections: shown as lines before they are saved, undone and redone without end, labels made again after each.
import * as api from '../api/client';
import type { Change, Preview } from '../api/model';
import { t } from '../words/words.svelte';
import { attempt, data } from './data.svelte';

class Editing {
  /** What would be saved; null: nothing is being corrected. */
  preview = $state.raw<Preview | null>(null);
  past = $state.raw<string[]>([]);
  future = $state.raw<string[]>([]);
}

export const editing = new Editing();

/** Show what changes would write. */
export async function propose(changes: Change[]): Promise<void> {
  await attempt(async () => {
    editing.preview = await api.preview(changes);
  });
}

/** Show what another text of the whole file would change. */
export async function proposeText(text: string): Promise<void> {
  await attempt(async () => {
    editing.preview = await api.preview([], text);
  });
}

/** Write what is shown, and map again what it touches. */
export async function accept(): Promise<void> {
  const { preview } = editing;
  if (!preview) return;
  await attempt(async () => {
    const before = data.corrections.text;
    await write(preview.text, preview.version, preview.touched);
    [editing.past, editing.future] = [[...editing.past, before], []];
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

export async function correctAtOnce(changes: Change[]): Promise<void> {
  await propose(changes);
  await accept();
}

export async function undo(): Promise<void> {
  const text = editing.past.at(-1);
  if (text === undefined) return;
  await attempt(async () => {
    const now = data.corrections.text;
    await write(text, data.corrections.version, null);
    [editing.past, editing.future] = [editing.past.slice(0, -1), [...editing.future, now]];
  });
}

export async function redo(): Promise<void> {
  const text = editing.future.at(-1);
  if (text === undefined) return;
  await attempt(async () => {
    const now = data.corrections.text;
    await write(text, data.corrections.version, null);
    [editing.past, editing.future] = [[...editing.past, now], editing.future.slice(0, -1)];
  });
}

async function write(text: string, version: string, sessions: string[] | null): Promise<void> {
  data.corrections = await api.save(text, version);
  data.notice = t('change.saved');
  await api.process(sessions);
}
