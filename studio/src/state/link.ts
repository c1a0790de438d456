// The view in the part of the address after `#`: it can be reloaded, gone back to, and sent to others.
import { COLOUR_BY, type ColourBy } from '../map/colours';
import { t } from '../words/words.svelte';
import { type Tab, choice, chooseSession } from './choice.svelte';
import { data } from './data.svelte';

/** What an address says; null: nothing of it, so that it is as at first. */
export interface View {
  walk: string | null;
  /** Seconds after the first frame of the walk. */
  time: number;
  tab: string | null;
  floor: number | null;
  colour: string | null;
  /** What is drawn on the map besides plan and walks. */
  shown: string[] | null;
}

export function viewOf(hash: string): View {
  const found = new URLSearchParams(hash.replace(/^#/, ''));
  const floor = found.get('floor');
  return {
    walk: found.get('walk'),
    time: Math.max(0, Number(found.get('t')) || 0),
    tab: found.get('tab'),
    floor: /^-?\d{1,6}$/.test(floor ?? '') ? Number(floor) : null,
    colour: found.get('colour'),
    shown: found.has('show') ? found.getAll('show').filter(Boolean) : null,
  };
}

export function hashOf({ walk, time, tab, floor, colour, shown }: View): string {
  const parts = [
    ['walk', walk],
    ['t', walk !== null && time > 0 ? time.toFixed(1) : null],
    ['tab', tab],
    ['floor', floor],
    ['colour', colour],
    ...(shown?.length === 0 ? [''] : (shown ?? [])).map((name) => ['show', name]),
  ];
  return `#${new URLSearchParams(parts.filter(([, value]) => value !== null).map((part) => part.map(String))).toString()}`;
}

/** Whether one goes back from a view to another; on the way through a walk the floor follows the moment. */
export const isStep = (from: View, to: View): boolean =>
  from.tab !== null && (from.tab !== to.tab || from.walk !== to.walk || (from.floor !== to.floor && to.time === 0));

/** What can be drawn besides layers, by its name in addresses. */
const MARKS = { events: 'showEvents', scans: 'showScans', band: 'showBand', stacked: 'stacked' } as const;
const MARK_NAMES = Object.keys(MARKS) as (keyof typeof MARKS)[];
const FIRST: { colour: ColourBy; marks: string[] } = { colour: 'status', marks: ['events'] };

const shownAtFirst = () => [...FIRST.marks, ...data.layers.filter(({ shown }) => shown).map(({ name }) => name)].sort();
const shownNow = () => [...MARK_NAMES.filter((name) => choice[MARKS[name]]), ...Object.keys(choice.layers).filter((name) => choice.layers[name])].sort();

function show(names: string[]): void {
  for (const name of MARK_NAMES) choice[MARKS[name]] = names.includes(name);
  choice.layers = Object.fromEntries(data.layers.map(({ name }) => [name, names.includes(name)]));
}

function viewNow(): View {
  const shown = shownNow();
  return {
    walk: choice.session,
    time: Number(choice.time.toFixed(1)),
    tab: choice.tab,
    floor: choice.floor,
    colour: choice.colourBy === FIRST.colour ? null : choice.colourBy,
    shown: shown.join('\n') === shownAtFirst().join('\n') ? null : shown,
  };
}

/** Show what the page's address leads to; other tabs than those named are not on this page. */
export function openLink(tabs: Tab[]): void {
  const view = viewOf(location.hash);
  if (view.walk !== null && !data.byId.has(view.walk)) data.problem = t('link.unknown', { walk: view.walk });
  const walk = view.walk !== null && data.byId.has(view.walk) ? view.walk : null;
  if (data.survey?.floors.some(({ number }) => number === view.floor)) choice.floor = view.floor!;
  if (walk !== choice.session) {
    chooseSession(walk);
    choice.centred = view.time > 0;
  }
  choice.time = walk === null ? 0 : view.time;
  choice.tab = tabs.find((tab) => tab === view.tab) ?? (walk === null ? choice.tab : 'walks');
  choice.colourBy = COLOUR_BY.find((by) => by === view.colour) ?? FIRST.colour;
  show(view.shown ?? shownAtFirst());
}

/** A moment is in the address once the time rests for so long, which it does not while a walk is played. */
const RESTS_MS = 300;

/** Keep the address as the view is, with a step for Back to go back; to be returned in an effect. */
export function followView(): () => void {
  const [view, before] = [viewNow(), location.hash];
  if (isStep(viewOf(before), view)) history.pushState(null, '', hashOf(view));
  const wait = setTimeout(() => {
    if (location.hash === before) keepView(); // else one went back, and the view follows
  }, RESTS_MS);
  return () => clearTimeout(wait);
}

export const keepView = (): void => history.replaceState(null, '', hashOf(viewNow()));

/** Copy the link to what is shown, if the browser lets us. */
export async function makeLink(): Promise<void> {
  keepView();
  try {
    await navigator.clipboard.writeText(location.href);
    data.notice = t('link.made');
  } catch {
    data.notice = t('link.shown'); // no clipboard without HTTPS, or its use was refused
  }
}
