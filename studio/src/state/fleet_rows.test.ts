import { expect, test } from 'vitest';
import type { Row } from '../api/fleet';
import { matches } from './fleet_rows';

const row: Row = { survey: 'ward-7', site: 'St Mary', floors: 2, devices: 'LG, S10', first_date: '2026-05-30', last_date: '2026-06-02', sessions: 4, failed: 0, state: 'done', labelled_share: 0.9, page: true };
const any = { text: '', state: '', from: '', to: '' };

test('a row fits by its text, state and days', () => {
  for (const wanted of [{}, { text: ' MARY ' }, { text: 's10' }, { state: 'done' }, { from: '2026-06-02' }, { to: '2026-05-30' }, { from: '2026-06-01', to: '2026-06-01' }])
    expect([wanted, matches(row, { ...any, ...wanted })]).toEqual([wanted, true]);
  for (const wanted of [{ text: 'ward-8' }, { state: 'new' }, { from: '2026-06-03' }, { to: '2026-05-29' }, { text: 'ward', state: 'failed' }])
    expect([wanted, matches(row, { ...any, ...wanted })]).toEqual([wanted, false]);
});

test('a survey without a day is of no day', () => {
  const undated = { ...row, first_date: '', last_date: '' };
  expect(matches(undated, any)).toBe(true);
  expect(matches(undated, { ...any, from: '2026-01-01' })).toBe(false);
  expect(matches(undated, { ...any, to: '2026-12-31' })).toBe(false);
});
