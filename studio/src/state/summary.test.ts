import { expect, test } from 'vitest';
import type { Session } from '../api/model';
import { summaryOf } from './summary';

const walk = (duration_s: number, labelled_share: number, sigma_median_m: number | null, excluded = false) =>
  ({ duration_s, labelled_share, sigma_median_m, labelled: true, excluded }) as unknown as Session;

test('the labelled share counts time, sigma is the mean of the walks that have one, excluded walks do not count', () => {
  expect(summaryOf([walk(100, 1, 0.2), walk(300, 0, null), walk(50, 0, 9, true)])).toEqual({ share: 0.25, sigma: 0.2 });
  expect(summaryOf([walk(100, 0.5, 0.2), walk(100, 0.5, 0.4)]).sigma).toBeCloseTo(0.3);
  expect(summaryOf([walk(100, 1, 0.1, true)])).toEqual({ share: null, sigma: null });
});
