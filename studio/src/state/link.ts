// Links to one walk at one moment: the part of the address after `#`.
import { t } from '../words/words.svelte';
import { choice, chooseSession } from './choice.svelte';
import { data } from './data.svelte';

/** `#walk=ID&t=SECONDS` of an address; null: it names no walk. */
export function momentOf(hash: string): { walk: string; time: number } | null {
  const found = new URLSearchParams(hash.replace(/^#/, ''));
  const walk = found.get('walk');
  return walk === null ? null : { walk, time: Math.max(0, Number(found.get('t')) || 0) };
}

export const hashOf = (walk: string, time: number): string => `#${new URLSearchParams({ walk, t: time.toFixed(1) }).toString()}`;

/** Show what the page's address leads to. */
export function openLink(): void {
  const moment = momentOf(location.hash);
  if (!moment) return;
  if (!data.byId.has(moment.walk)) {
    data.problem = t('link.unknown', { walk: moment.walk });
    return;
  }
  chooseSession(moment.walk);
  choice.tab = 'walks';
  choice.time = moment.time;
}

/** Put the link to what is shown into the page's address, and copy it where the browser lets us. */
export async function makeLink(): Promise<void> {
  if (choice.session === null) return;
  history.replaceState(null, '', hashOf(choice.session, choice.time));
  try {
    await navigator.clipboard.writeText(location.href);
    data.notice = t('link.made');
  } catch {
    data.notice = t('link.shown'); // no clipboard without HTTPS, or its use was refused
  }
}
