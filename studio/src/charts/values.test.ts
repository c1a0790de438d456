import { expect, test } from 'vitest';
import { inDegrees } from '../state/walk.svelte';
import { timeTicks } from './values';

test('the axis of time has round steps', () => {
  expect(timeTicks(150, 6)).toEqual([0, 30, 60, 90, 120, 150]);
  expect(timeTicks(4, 10)).toEqual([0, 1, 2, 3, 4]);
});

test('angles are shown in degrees, other values as they are', () => {
  const series = (number: number) => ({ number, t: Float32Array.of(0), v: Float32Array.of(Math.PI) });
  expect([0, 1, 7].map((number) => inDegrees(series(number)).v[0])).toEqual([Math.PI, 180, 180].map((value) => expect.closeTo(value, 4)));
});
