import { expect, test } from 'vitest';
import type { Diagnosis, Session, Shared, Survey } from '../api/model';
import { nextTask } from './next';

const survey = (floors: number, landmarks: number) => ({ floors: Array(floors), landmarks: Array(landmarks) }) as unknown as Survey;
const walk = (stale: boolean) => [{ stale }] as unknown as Session[];
const diagnosis = (state: string) => ({ state }) as unknown as Diagnosis;
const shared = (dataset: boolean | null, page: boolean | null) =>
  ({ dataset: dataset === null ? null : { stale: dataset }, page: page === null ? null : { stale: page } }) as unknown as Shared;

test('the first task that is not done comes next', () => {
  const all = survey(1, 4);
  const full = diagnosis('full');
  expect(nextTask(survey(0, 0), [], null, 0, null)).toBe('plan');
  expect(nextTask(survey(1, 0), [], null, 0, null)).toBe('landmarks');
  expect(nextTask(all, [], null, 0, null)).toBe('collect');
  expect(nextTask(all, walk(true), full, 2, null)).toBe('process');
  expect(nextTask(all, walk(false), diagnosis('quick'), 2, null)).toBe('correct');
  expect(nextTask(all, walk(false), diagnosis('quick'), 0, shared(null, null))).toBe('search');
  expect(nextTask(all, walk(false), full, 0, shared(null, null))).toBe('dataset');
  expect(nextTask(all, walk(false), full, 0, shared(true, null))).toBe('dataset');
  expect(nextTask(all, walk(false), full, 0, shared(false, null))).toBe('share');
  expect(nextTask(all, walk(false), full, 0, shared(false, false))).toBeNull();
});
