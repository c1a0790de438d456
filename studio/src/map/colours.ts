// Colour of each point of a walk, as an index into a short palette, so that points of one colour are drawn together.
import type { Track } from '../api/arrow';
import type { Session, StatusStyle } from '../api/model';
import { named } from '../words/words.svelte';

export type ColourBy = 'status' | 'sigma' | 'speed' | 'session' | 'device' | 'age';
export const COLOUR_BY: ColourBy[] = ['status', 'sigma', 'speed', 'session', 'device', 'age'];

export interface Colouring {
  palette: string[];
  /** What stands in the legend beside each colour of the palette; a gradient has the two ends only. */
  legend: { colour: string; text: string }[];
  index(track: Track, row: number): number;
}

// Okabe and Ito, which the colour-blind can tell apart; viridis for what has an order.
export const DISTINCT = ['#0072b2', '#e69f00', '#009e73', '#d55e00', '#cc79a7', '#56b4e9', '#9a6200', '#6e7781'];
export const ORDERED = ['#440154', '#46327e', '#365c8d', '#277f8e', '#1fa187', '#4ac16d', '#a0da39', '#fde725'];
const UNKNOWN = '#9aa2ab';

function ordered(low: number, high: number, value: (track: Track, row: number) => number, ends: string[]): Colouring {
  const steps = ORDERED.length;
  return {
    palette: [...ORDERED, UNKNOWN],
    legend: ORDERED.map((colour, step) => ({ colour, text: step === 0 ? ends[0] : step === steps - 1 ? ends[1] : '' })),
    index(track, row) {
      const share = (value(track, row) - low) / (high - low || 1);
      return Number.isNaN(share) ? steps : Math.max(0, Math.min(steps - 1, Math.floor(share * steps)));
    },
  };
}

function distinct(sessions: Session[], group: (session: Session) => string): Colouring {
  const groups = [...new Set(sessions.map(group))];
  const place = new Map(groups.map((name, number) => [name, number % DISTINCT.length]));
  const bySession = Uint8Array.from(sessions, (session) => place.get(group(session))!);
  return {
    palette: DISTINCT,
    legend: groups.slice(0, 12).map((text, number) => ({ colour: DISTINCT[number % DISTINCT.length], text })),
    index: (track, row) => bySession[track.session[row]],
  };
}

/** How points are coloured; sigma saturates at the limit of the survey, speed at 2 m/s. */
export function colouring(by: ColourBy, sessions: Session[], statuses: StatusStyle[], sigmaLimit: number): Colouring {
  switch (by) {
    case 'status': {
      const palette: string[] = [];
      for (const status of statuses) palette[status.code] = status.colour;
      return {
        palette,
        legend: statuses.filter((status) => status.has_position).map(({ colour, label }) => ({ colour, text: named('status', label) })),
        index: (track, row) => track.status[row],
      };
    }
    case 'sigma':
      return ordered(0, sigmaLimit, (track, row) => track.sigma[row], ['0 m', `≥ ${sigmaLimit} m`]);
    case 'speed':
      return ordered(0, 2, (track, row) => track.speed[row], ['0 m/s', '≥ 2 m/s']);
    case 'session':
      return distinct(sessions, (session) => session.key.session);
    case 'device':
      return distinct(sessions, (session) => session.key.device);
    case 'age': {
      const starts = sessions.map((session) => (session.start ? Date.parse(session.start) : NaN));
      const known = starts.filter((start) => !Number.isNaN(start));
      const [low, high] = [Math.min(...known), Math.max(...known)];
      const day = (time: number) => (Number.isFinite(time) ? new Date(time).toISOString().slice(0, 10) : '');
      return ordered(low, high, (track, row) => starts[track.session[row]], [day(low), day(high)]);
    }
  }
}

/** The same colours, lighter: for dark ground. */
export function lightened(colours: Colouring): Colouring {
  return {
    ...colours,
    palette: colours.palette.map(lighter),
    legend: colours.legend.map(({ colour, text }) => ({ colour: lighter(colour), text })),
  };
}

export function lighter(colour: string): string {
  const channels = [1, 3, 5].map((place) => parseInt(colour.slice(place, place + 2), 16));
  return `#${channels.map((value) => Math.round(value + 0.3 * (255 - value)).toString(16).padStart(2, '0')).join('')}`;
}
