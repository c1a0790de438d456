// How well some walks are labelled.
import type { Session } from '../api/model';

export interface Summary {
  /** Share of their time that is labelled; null: none of them has labels. */
  share: number | null;
  /** Mean of the median sigma of each, metres. */
  sigma: number | null;
}

export function summaryOf(sessions: Session[]): Summary {
  const labelled = sessions.filter((session) => session.labelled && !session.excluded);
  const seconds = labelled.reduce((sum, { duration_s }) => sum + duration_s, 0);
  const sigmas = labelled.flatMap(({ sigma_median_m }) => sigma_median_m ?? []);
  return {
    share: seconds ? labelled.reduce((sum, { duration_s, labelled_share }) => sum + duration_s * (labelled_share ?? 0), 0) / seconds : null,
    sigma: sigmas.length ? sigmas.reduce((sum, sigma) => sum + sigma, 0) / sigmas.length : null,
  };
}
