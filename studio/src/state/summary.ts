// How well some walks are labelled.
import type { Session } from '../api/model';

export interface Summary {
  /** Share of their time that is labelled; null: none of them has labels. */
  share: number | null;
  /** Expected mean error of their labels, metres. */
  error: number | null;
  /** Those that could not be processed. */
  failed: number;
}

export function summaryOf(sessions: Session[]): Summary {
  const labelled = sessions.filter((session) => session.labelled && !session.excluded);
  const timeOf = (session: Session) => session.duration_s * (session.labelled_share ?? 0);
  const judged = labelled.filter((session) => session.expected_error_m !== null);
  return {
    failed: sessions.filter(({ error, excluded }) => error !== null && !excluded).length,
    share: ratio(sum(labelled.map(timeOf)), sum(labelled.map(({ duration_s }) => duration_s))),
    error: ratio(sum(judged.map((session) => timeOf(session) * session.expected_error_m!)), sum(judged.map(timeOf))),
  };
}

const sum = (values: number[]): number => values.reduce((all, value) => all + value, 0);
const ratio = (part: number, whole: number): number | null => (whole ? part / whole : null);
