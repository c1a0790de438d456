import { beforeEach, expect, test, vi } from 'vitest';

const server = vi.hoisted(() => ({ text: '', version: '0', mapped: [] as (string[] | null)[], refuse: false, conflict: false, undone: [] as { before: string; after: string }[] }));

vi.mock('../api/client', () => {
  class Refusal extends Error {
    constructor(readonly problem: { code: string; message: string; conflicts: unknown[] }) {
      super(problem.message);
    }
  }
  const view = () => ({ text: server.text, version: server.version, entries: [], problem: null });
  const written = (text: string) => {
    server.text = text;
    server.version = String(Number(server.version) + 1);
    return view();
  };
  return {
    Refusal,
    Unreachable: class extends Error {},
    reading: {},
    preview: async ({ base, changes }: { base: string; changes: { table: string }[] }) => ({
      before: server.text, text: `${server.text}[[${changes[0].table}]]\n`, version: server.version, lines: base, entries: [], touched: ['a'],
    }),
    save: async (text: string, version: string) => {
      if (server.refuse || version !== server.version) throw new Error('stale');
      return written(text);
    },
    /** As the server, of whole lines. */
    undo: async (step: { before: string; after: string }) => {
      server.undone.push(step);
      const change = step.after.length > step.before.length ? step.after.slice(step.before.length) : null;
      if (server.conflict) throw new Refusal({ code: 'conflict', message: 'changed', conflicts: [{ table: 'a', expected: '1', now: '2' }] });
      const before = server.text;
      return { before, corrections: written(change ? before.replace(change, '') : before + step.before.slice(step.after.length)) };
    },
    process: async (ids: string[] | null) => ({ id: server.mapped.push(ids) }),
  };
});

import { data } from './data.svelte';
import { accept, correctAtOnce, editing, propose, redo, undo } from './editing.svelte';
import { result } from './result.svelte';

const add = (table: string) => correctAtOnce([{ action: 'add', table, values: {} }]);

beforeEach(() => {
  Object.assign(server, { text: '', version: '0', mapped: [], refuse: false, conflict: false, undone: [] });
  Object.assign(editing, { past: [], future: [], preview: null, conflicts: null });
  Object.assign(data, { problem: '', corrections: { text: '', version: '0', entries: [], problem: null } });
});

test('corrections are undone and redone in their order, and walks mapped again each time', async () => {
  await add('a');
  await add('b');
  void undo();
  await undo();
  expect(server.text).toBe('');
  await undo();
  expect(server.text).toBe('');
  expect(result.asked).toMatchObject({ kind: 'undo', ids: ['a'] });
  await redo();
  await redo();
  expect(server.text).toBe('[[a]]\n[[b]]\n');
  expect(server.mapped).toEqual([['a'], ['a'], null, null, null, null]);
});

test('undo takes back what this page saved and leaves what others wrote, before this page knew of it, too', async () => {
  server.text = '[[theirs]]\n'; // not heard of yet
  await add('a');
  server.text += '[[later]]\n';
  await undo();
  expect(server.text).toBe('[[theirs]]\n[[later]]\n');
  expect(server.undone).toEqual([{ before: '[[theirs]]\n', after: '[[theirs]]\n[[a]]\n' }]);
  expect(data.corrections.text).toBe(server.text);
});

test('a new correction ends what could be redone', async () => {
  await add('a');
  await undo();
  await add('b');
  await redo();
  expect(server.text).toBe('[[b]]\n');
});

test('what the server refuses is shown and is not in the history', async () => {
  server.refuse = true;
  await add('a');
  expect(data.problem).toBe('stale');
  expect(editing.past).toEqual([]);
  expect(server.mapped).toEqual([]);
});

test('a conflict is shown with both values, and the change before it can be undone', async () => {
  await add('a');
  await add('b');
  server.conflict = true;
  await undo();
  expect(editing.conflicts).toEqual({ kind: 'undo', found: [{ table: 'a', expected: '1', now: '2' }] });
  expect(data.problem).toBe('');
  expect(server.text).toBe('[[a]]\n[[b]]\n');
  server.conflict = false;
  await undo();
  expect(server.undone.at(-1)).toEqual({ before: '', after: '[[a]]\n' });
});

test('of two clicks the second does nothing while the first is answered', async () => {
  const change = [{ action: 'add' as const, table: 'a', values: {} }];
  const first = correctAtOnce(change);
  expect(editing.busy).toBe(true);
  await Promise.all([first, correctAtOnce(change)]);
  expect(server.text).toBe('[[a]]\n');
  await propose([{ action: 'add', table: 'b', values: {} }]);
  await Promise.all([accept(), accept()]);
  expect(server.text).toBe('[[a]]\n[[b]]\n');
  expect([data.problem, editing.busy]).toEqual(['', false]);
});
