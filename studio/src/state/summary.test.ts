import { expect, test } from 'vitest';
import type { Session } from '../api/model';
import { summaryOf } from './summary';

const walk = (duration_s: number, labelled_share: number, expected_error_m: number | null, excluded = false) =>
  ({ duration_s, labelled_share, expected_error_m, labelled: true, excluded, error: null }) as unknown as Session;

test('the labelled share counts time, the error counts labelled time of walks that have one, excluded walks do not count', () => {
  expect(summaryOf([walk(100, 1, 0.2), walk(300, 0, null), walk(50, 0, 9, true)])).toEqual({ share: 0.25, error: 0.2, failed: 0 });
  expect(summaryOf([walk(100, 0.75, 0.2), walk(100, 0.25, 0.4)]).error).toBeCloseTo(0.25);
  expect(summaryOf([walk(100, 1, 0.1, true)])).toEqual({ share: null, error: null, failed: 0 });
});

test('walks that could not be processed are counted', () => {
  expect(summaryOf([{ ...walk(0, 0, null), labelled: false, error: 'no poses' }]).failed).toBe(1);
});
