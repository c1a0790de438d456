// Which surveys of a fleet's list are looked for.
import type { Row } from '../api/fleet';

export interface Wanted {
  /** In names, sites and devices, upper or lower case. */
  text: string;
  state: string;
  /** Days as 2026-05-31: somebody walked between them; empty: any. */
  from: string;
  to: string;
}

/** Whether a row fits all that is wanted; what is empty fits any. */
export function matches(row: Row, { text, state, from, to }: Wanted): boolean {
  const told = [row.survey, row.site, row.devices].join('\n').toLowerCase();
  if (!told.includes(text.trim().toLowerCase()) || (state && row.state !== state)) return false;
  return !(from || to) || (row.first_date !== '' && row.last_date >= from && (!to || row.first_date <= to));
}
