import { expect, test } from 'vitest';
import { readSeries, runs } from '../api/arrow';
import type { SessionDetail } from '../api/model';
import { tableFromArrays, tableToIPC } from '@uwdata/flechette';
import { momentsOf, nextMoment, rowAt } from './walk.svelte';

const detail = {
  visits: [{ t: 4, landmark: '7' }, { t: 9, landmark: '3' }],
  events: [{ t: 6, kind: 'break' }],
  contradictions: [{ landmark: '3' }],
} as unknown as SessionDetail;

test('moments come in order of time, landmarks that walks contradict as findings', () => {
  expect(momentsOf(detail).map(({ t, kind }) => [t, kind])).toEqual([[4, 'landmark'], [6, 'event'], [9, 'finding']]);
  expect(momentsOf(null)).toEqual([]);
});

test('one jumps to the next or the one before, of a kind or of any', () => {
  const moments = momentsOf(detail);
  expect(nextMoment(moments, 4, 1, null)?.t).toBe(6);
  expect(nextMoment(moments, 4, 1, 'landmark')?.t).toBe(9);
  expect(nextMoment(moments, 9, -1, null)?.t).toBe(6);
  expect(nextMoment(moments, 9, 1, null)).toBeUndefined();
});

test('the frame at a time is the last one not after it', () => {
  const times = Float32Array.of(0, 1, 2, 2, 5);
  expect([-1, 0, 1.5, 2, 4.9, 9].map((time) => rowAt(times, time))).toEqual([0, 0, 1, 3, 3, 4]);
});

test('runs of equal values', () => {
  expect(runs([4, 4, 1, 4])).toEqual([[0, 2], [2, 3], [3, 4]]);
  expect(runs([])).toEqual([]);
});

test('charts are told apart by their number', () => {
  const bytes = tableToIPC(tableFromArrays({ series: Uint8Array.of(0, 0, 3), t: Float32Array.of(0, 1, 0), v: Float32Array.of(5, 6, 7) }), { format: 'stream' })!;
  const found = readSeries(bytes.slice().buffer as ArrayBuffer);
  expect(found.map(({ number, t, v }) => [number, [...t], [...v]])).toEqual([[0, [0, 1], [5, 6]], [3, [0], [7]]]);
});
