import { expect, test } from 'vitest';
import type { Session } from '../api/model';
import { sorted } from './walk_rows';

const session = (name: string, labelled_share: number | null, sigma_median_m: number | null, severity: string | null) =>
  ({ key: { session: name }, labelled: labelled_share !== null, labelled_share, sigma_median_m, severity }) as unknown as Session;
const walks = [session('b', 0, 0.2, null), session('c', null, null, 'info'), session('a', 0.9, 0.1, 'error')];
const names = (found: Session[]) => found.map(({ key }) => key.session).join('');

test('walks are sorted by name, labelled share, sigma and severity, and the other way round', () => {
  expect(names(sorted(walks, 'name', false))).toBe('abc');
  expect(names(sorted(walks, 'name', true))).toBe('cba');
  expect(names(sorted(walks, 'share', false))).toBe('cba');
  expect(names(sorted(walks, 'sigma', false))).toBe('abc');
  expect(names(sorted(walks, 'state', false))).toBe('acb');
});
