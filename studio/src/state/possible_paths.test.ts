import { expect, test } from 'vitest';
import { momentToTap, placeAt, shownPaths } from './possible_paths';

const path = (weight: number) => ({ weight, points: [] });

test('probable paths are shown, the weight of all others is added up', () => {
  const { paths, rest } = shownPaths([0.5, 0.3, 0.1, 0.015, 0.005].map(path));
  expect(paths.map(({ weight }) => weight)).toEqual([0.5, 0.3, 0.1]);
  expect(rest).toBeCloseTo(0.1);
});

test('at most eight paths are shown, at least one, and without any there is no rest', () => {
  expect(shownPaths(Array.from({ length: 12 }, () => path(0.08))).paths).toHaveLength(8);
  expect(shownPaths([path(0.01)]).paths).toHaveLength(1);
  expect(shownPaths([])).toEqual({ paths: [], rest: 0 });
});

test('a place is between the points of the times around the moment, and never beyond the ends', () => {
  const points: [number, number][] = [[0, 0], [4, 2], [4, 6]];
  expect([0, 10, 15, 25, 30, 99].map((time) => placeAt([10, 20, 30], points, time))).toEqual([[0, 0], [0, 0], [2, 1], [4, 4], [4, 6], [4, 6]]);
});

test('one taps when the server says, or far from the taps that were not enough', () => {
  const t = [5, 20, 40, 70];
  expect(momentToTap({ tap_s: 20, reason: 'ambiguous', t }, [5])).toBe(20);
  expect(momentToTap({ tap_s: null, reason: 'fits_mirror', t }, [5])).toBe(70);
  expect(momentToTap({ tap_s: null, reason: 'fits_mirror', t }, [5, 70])).toBe(40);
  expect(momentToTap({ tap_s: null, reason: 'fits_mirror', t }, [])).toBe(40);
});

test('no tap is asked for where none is needed, or none helps', () => {
  const t = [5, 20];
  for (const reason of ['ok', 'fits_nowhere']) expect(momentToTap({ tap_s: null, reason, t }, [5])).toBeNull();
  expect(momentToTap({ tap_s: null, reason: 'fits_mirror', t: [] }, [])).toBeNull();
});
