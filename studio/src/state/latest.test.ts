import { expect, test } from 'vitest';
import { data } from './data.svelte';
import { latest } from './latest';

test('an answer that comes after its question was withdrawn is dropped, and so is its error', async () => {
  const taken: number[] = [];
  const answers: ((value: number) => void)[] = [];
  const ask = () => new Promise<number>((resolve) => answers.push(resolve));
  latest(ask, (value) => taken.push(value))();
  latest(ask, (value) => taken.push(value));
  latest(() => Promise.reject(new Error('late')), () => {})();
  answers[1](2);
  answers[0](1);
  await new Promise((done) => setTimeout(done));
  expect([taken, data.problem]).toEqual([[2], '']);
  latest(() => Promise.reject(new Error('wanted')), () => {});
  await new Promise((done) => setTimeout(done));
  expect(data.problem).toBe('wanted');
});
