// Colour and dashes of each point of a walk, as an index into a short list of looks, so that points of one look are drawn together.
import type { Track } from '../api/arrow';
import type { Session, StatusStyle } from '../api/model';
import { named, number } from '../words/words.svelte';

export type ColourBy = 'status' | 'sigma' | 'speed' | 'session' | 'device' | 'age';
export const COLOUR_BY: ColourBy[] = ['status', 'sigma', 'speed', 'session', 'device', 'age'];

export interface Look {
  colour: string;
  dash?: number[];
}

/** Points of walks that have one look; `session` says of which sessions they are, if not of all. */
export interface Kind extends Look {
  key: string;
  text: string;
  index: number;
  session?(index: number): boolean;
}

export interface Colouring {
  looks: Look[];
  kinds: Kind[];
  /** Values along the ordered colours, at equal distances; null: kinds have no order. */
  ticks: string[] | null;
  index(track: Track, row: number): number;
}

// Okabe and Ito, which the colour-blind can tell apart; viridis for what has an order.
export const DISTINCT = ['#0072b2', '#e69f00', '#009e73', '#d55e00', '#cc79a7', '#56b4e9', '#9a6200', '#6e7781'];
export const ORDERED = ['#440154', '#46327e', '#365c8d', '#277f8e', '#1fa187', '#4ac16d', '#a0da39', '#fde725'];
export const DASHES = [undefined, [10, 6], [3, 5], [12, 5, 3, 5]];
const UNKNOWN = '#9aa2ab';
/** On the map it crosses labelled parts, from which its light blue in reports hardly differs in the dark. */
const UNCERTAIN: Look = { colour: '#e69f00' };

/** Look of the n-th of many: 8 colours, then the same colours with other dashes. */
export const lookOf = (place: number): Look => ({ colour: DISTINCT[place % DISTINCT.length], dash: DASHES[Math.floor(place / DISTINCT.length) % DASHES.length] });

/** Values at equal distances from end to end, as text. */
export const ticksOf = ([low, high]: [number, number], text: (value: number) => string, count = 3): string[] =>
  Array.from({ length: count }, (_, place) => text(low + (place * (high - low)) / (count - 1)));

function ordered(ends: [number, number], value: (track: Track, row: number) => number, ticks: string[]): Colouring {
  const [low, high] = ends;
  const steps = ORDERED.length;
  return {
    looks: [...ORDERED, UNKNOWN].map((colour) => ({ colour })),
    kinds: [],
    ticks,
    index(track, row) {
      const share = (value(track, row) - low) / (high - low || 1);
      return Number.isNaN(share) ? steps : Math.max(0, Math.min(steps - 1, Math.floor(share * steps)));
    },
  };
}

function distinct(by: string, sessions: Session[], group: (session: Session) => string): Colouring {
  const groups = [...new Set(sessions.map(group))];
  const looks = groups.map((_, place) => lookOf(place));
  const place = new Map(groups.map((name, number) => [name, number]));
  const bySession = Uint16Array.from(sessions, (session) => place.get(group(session))!);
  return {
    looks,
    kinds: groups.map((text, index) => ({ ...looks[index], key: `${by}:${text}`, text, index, session: (of) => bySession[of] === index })),
    ticks: null,
    index: (track, row) => bySession[track.session[row]],
  };
}

/** How points are coloured; sigma saturates at the limit of the survey, speed at 2 m/s. */
export function colouring(by: ColourBy, sessions: Session[], statuses: StatusStyle[], sigmaLimit: number): Colouring {
  const saturated = (ends: [number, number], unit: string) => ticksOf(ends, (value) => `${value === ends[1] ? '≥ ' : ''}${number(value, Number.isInteger(value) ? 0 : 2)} ${unit}`);
  switch (by) {
    case 'status': {
      const looks: Look[] = [];
      for (const { code, label, colour } of statuses) looks[code] = label === 'uncertain' ? UNCERTAIN : { colour };
      const kinds = statuses.filter((status) => status.has_position).map(({ code, label }) => ({ ...looks[code], key: `status:${label}`, text: named('status', label), index: code }));
      return { looks, kinds, ticks: null, index: (track, row) => track.status[row] };
    }
    case 'sigma':
      return ordered([0, sigmaLimit], (track, row) => track.sigma[row], saturated([0, sigmaLimit], 'm'));
    case 'speed':
      return ordered([0, 2], (track, row) => track.speed[row], saturated([0, 2], 'm/s'));
    case 'session':
      return distinct(by, sessions, (session) => session.key.session);
    case 'device':
      return distinct(by, sessions, (session) => session.key.device);
    case 'age': {
      const starts = sessions.map((session) => (session.start ? Date.parse(session.start) : NaN));
      const known = starts.filter((start) => !Number.isNaN(start));
      const ends: [number, number] = [Math.min(...known), Math.max(...known)];
      const day = (time: number) => new Date(time).toISOString().slice(0, 10);
      return ordered(ends, (track, row) => starts[track.session[row]], known.length ? ticksOf(ends, day) : []);
    }
  }
}

const CLEAR = '#00000000';

/** Without what is hidden, and with the looks for dark ground where the page is dark. */
export function shownColours(colours: Colouring, hidden: Record<string, boolean>, dark: boolean): Colouring {
  const shade = <T extends Look>(look: T): T => (dark ? { ...look, colour: lighter(look.colour) } : look);
  const looks = colours.looks.map(shade);
  for (const { key, index, session } of colours.kinds) if (hidden[key] && !session) looks[index] = { colour: CLEAR };
  return { ...colours, looks: hidden.walks ? looks.map(() => ({ colour: CLEAR })) : looks, kinds: colours.kinds.map(shade) };
}

export function lighter(colour: string): string {
  const channels = [1, 3, 5].map((place) => parseInt(colour.slice(place, place + 2), 16));
  return `#${channels.map((value) => Math.round(value + 0.3 * (255 - value)).toString(16).padStart(2, '0')).join('')}`;
}
