import { beforeEach, expect, test, vi } from 'vitest';

const server = vi.hoisted(() => ({ text: '', version: '0', mapped: [] as (string[] | null)[], refuse: false }));

vi.mock('../api/client', () => ({
  Refusal: class extends Error {},
  reading: {},
  preview: async (changes: { table: string }[]) => ({ text: `${server.text}[[${changes[0].table}]]\n`, version: server.version, lines: '', entries: [], added: [], touched: ['a'] }),
  save: async (text: string, version: string) => {
    if (server.refuse || version !== server.version) throw new Error('stale');
    server.text = text;
    server.version = String(Number(version) + 1);
    return { text, version: server.version, entries: [], problem: null };
  },
  process: async (ids: string[] | null) => void server.mapped.push(ids),
}));

import { data } from './data.svelte';
import { correctAtOnce, editing, redo, undo } from './editing.svelte';

const add = (table: string) => correctAtOnce([{ action: 'add', table, values: {} }]);

beforeEach(() => {
  Object.assign(server, { text: '', version: '0', mapped: [], refuse: false });
  Object.assign(editing, { past: [], future: [], preview: null });
  Object.assign(data, { problem: '', corrections: { text: '', version: '0', entries: [], problem: null } });
});

test('corrections are undone and redone in their order, and walks mapped again each time', async () => {
  await add('a');
  await add('b');
  await undo();
  await undo();
  expect(server.text).toBe('');
  await undo();
  expect(server.text).toBe('');
  await redo();
  await redo();
  expect(server.text).toBe('[[a]]\n[[b]]\n');
  expect(server.mapped).toEqual([['a'], ['a'], null, null, null, null]);
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
