// Where the page's data comes from: the studio's server, or files that an export wrote ahead.
import type { Series, Track } from './arrow';

export interface Source {
  /** An answer by its address without `/api/`. */
  json<T>(path: string, query?: Record<string, string | number>): Promise<T>;
  overview(output: string): Promise<Track>;
  /** Frames in a box [left, low, right, high] of a floor, metres: `points` at most; null where the overview has to do. */
  frames(output: string, floor: number, box: number[], points: number): Promise<Track | null>;
  walk(id: string, output: string): Promise<Track>;
  scans(output: string): Promise<Track>;
  series(id: string, output: string): Promise<Series[]>;
  /** Cells of a layer, row by row from the lower edge. */
  radioMap(floor: number, technology: string, layer: string, bssid: string): Promise<Float32Array>;
}

/** Nothing answers at an address. */
export class Unreachable extends Error {}

/** What comes over the network; if it breaks off, an Unreachable, whatever the browser calls it. */
export const reached = <T>(work: Promise<T>): Promise<T> =>
  work.catch((error: unknown) => {
    throw error instanceof TypeError ? new Unreachable(error.message) : error;
  });

/** Whether something answers at the page's own address. */
export const isReachable = (): Promise<boolean> =>
  fetch(location.pathname, { method: 'HEAD', cache: 'no-store' }).then(
    () => true,
    () => false,
  );

const told = document.querySelector<HTMLMetaElement>('meta[name=vislam2tag-data]')?.content;
const asked = new URLSearchParams(location.search).get('survey') ?? '';
const named = /^[A-Za-z0-9][A-Za-z0-9._-]*$/.test(asked) && asked;

/** Folder of the list of a fleet's surveys; null: the page is of one survey. */
export const list = told === 'fleet' ? `${told}/` : null;

/** Folder of the data of an exported page, which only shows; null: a studio runs, or no survey of the list is chosen. */
export const folder = list ? (named ? `surveys/${named}/` : null) : told ? `${told}/` : null;
