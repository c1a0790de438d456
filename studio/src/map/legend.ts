// What the legend says: one entry for each kind that is drawn now, by which the kind is hidden and shown.
import type Feature from 'ol/Feature';
import type { Track } from '../api/arrow';
import type { Placing } from './affine';
import type { Colouring, Look } from './colours';

export interface Entry extends Look {
  key: string;
  text: string;
  symbol: 'line' | 'area' | 'square' | 'diamond' | 'triangle' | 'event' | 'ring' | 'dot' | 'star' | 'arrow' | 'text';
}

/** Longer lists of walks are cut: names are shown by pointing at walks. */
const MOST_KINDS = 12;

/** Give a feature of the map its entry in the legend, and the text that is shown when one points at it. */
export function explain(feature: Feature, entry: Entry, tip = ''): Feature {
  feature.set('entry', entry);
  feature.set('tip', tip);
  return feature;
}

const entryOf = (feature: Feature) => feature.get('entry') as Entry | undefined;

/** Entries of features, each kind once. */
export const featureEntries = (features: Feature[]): Entry[] => [
  ...new Map(features.flatMap((feature) => entryOf(feature) ?? []).map((entry) => [entry.key, entry])).values(),
];

export const withoutHidden = (features: Feature[], hidden: Record<string, boolean>): Feature[] => features.filter((feature) => !hidden[entryOf(feature)?.key ?? '']);

/** Kinds of the points of a track that are on the placed floors, and how many more there are than are listed. */
export function walkEntries(track: Track, placing: Placing, listed: Uint8Array, colours: Colouring): { entries: Entry[]; more: number } {
  const [looks, sessions] = [new Set<number>(), new Set<number>()];
  for (let row = 0; row < track.rows; row++) {
    if (!listed[track.session[row]] || !placing.has(track.floor[row])) continue;
    looks.add(colours.index(track, row));
    sessions.add(track.session[row]);
  }
  const there = colours.kinds.filter(({ index, session }) => (session ? [...sessions].some(session) : looks.has(index)));
  const entries = there.slice(0, MOST_KINDS).map(({ key, text, colour, dash }): Entry => ({ key, text, colour, dash, symbol: 'line' }));
  return { entries, more: there.length - entries.length };
}
