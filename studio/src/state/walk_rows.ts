// The table of walks, sorted by one of its columns.
import type { Session } from '../api/model';

export const COLUMNS = ['name', 'share', 'sigma', 'state'] as const;
export type Column = (typeof COLUMNS)[number];

const SEVERITIES = ['error', 'warning', 'info'];
const KEYS: Record<Column, (session: Session) => string | number> = {
  name: ({ key }) => key.session,
  share: ({ labelled, labelled_share: share }) => (labelled ? (share ?? 0) : -1),
  sigma: ({ sigma_median_m: sigma }) => sigma ?? Infinity,
  state: ({ severity }) => (severity === null ? SEVERITIES.length : SEVERITIES.indexOf(severity)),
};

/** In ascending order of a column: its worst findings first, then as listed; unlabelled walks come before 0 %. */
export function sorted(sessions: Session[], by: Column, descending: boolean): Session[] {
  const key = KEYS[by];
  const ascending = sessions.toSorted((a, b) => (key(a) < key(b) ? -1 : Number(key(a) > key(b))));
  return descending ? ascending.reverse() : ascending;
}
