// Corrections of where a floor can be walked: strokes of a brush and polygons, taken back one by one, then written.
import Feature from 'ol/Feature';
import { LineString } from 'ol/geom';
import { Stroke as Pen, Style } from 'ol/style';
import * as api from '../api/client';
import type { Stroke, Walls } from '../api/model';
import { areaFeature } from '../map/marks';
import { type Draft, paintedDraft } from './drafts.svelte';
import { type Place, overlay } from './overlay.svelte';

const COLOUR = { open: '#009e73', closed: '#d55e00' };

interface Painted {
  strokes: Stroke[];
  /** Strokes that were taken back. */
  future: Stroke[];
  /** Corners that were set one by one. */
  corners: Place[];
  /** Whether what was corrected before counts no more. */
  anew: boolean;
}
const NOTHING: Painted = { strokes: [], future: [], corners: [], anew: false };

/** What is painted on a floor and not written; `plan` is the address of its plan, which changes with it. */
export const paintedOn = (floor: number, plan: string): Draft<Painted> => paintedDraft('walls', String(floor), NOTHING, plan);

class WallsState {
  view = $state.raw<Walls | null>(null);
  walkable = $state(false);
  tool = $state<'none' | Stroke['shape']>('none');
  width = $state(0.3);
}

export const walls = new WallsState();
let latest = 0;

/** Ask where the floor can be walked with strokes; of several answers the last counts. */
async function ask(floor: number, { strokes, anew }: Painted, write = false): Promise<boolean> {
  const mine = ++latest;
  const view = await api.walls({ floor, strokes, anew, write });
  if (mine === latest) walls.view = view;
  return mine === latest;
}

export const look = (floor: number, draft: Draft<Painted>) => ask(floor, draft.value);

/** Write what is painted into the survey. */
export async function writeWalls(floor: number, draft: Draft<Painted>): Promise<void> {
  const written = draft.value;
  await ask(floor, written, true);
  if (draft.value === written) discardWalls(draft);
}

export const discardWalls = (draft: Draft<Painted>) => draft.discard(NOTHING, draft.now);
export const followPlan = (draft: Draft<Painted>, plan: string) => draft.follow(NOTHING, plan);

/** Try something painted; if nothing could be walked with it, it is not taken. */
async function attemptWith(floor: number, draft: Draft<Painted>, painted: Painted): Promise<void> {
  const before = draft.value;
  draft.value = painted;
  try {
    await ask(floor, painted);
  } catch (error) {
    if (draft.value === painted) draft.value = before;
    throw error;
  }
}

export async function paint(floor: number, draft: Draft<Painted>, points: Place[]): Promise<void> {
  const { tool, walkable, width } = walls;
  draft.value = { ...draft.value, corners: [] };
  if (tool === 'none' || points.length < (tool === 'polygon' ? 3 : 2)) return;
  const thinned = points.filter((_, place) => points.length < 400 || place % Math.ceil(points.length / 400) === 0 || place === points.length - 1);
  const stroke: Stroke = { walkable, shape: tool, points: thinned, width_m: width };
  await attemptWith(floor, draft, { ...draft.value, strokes: [...draft.value.strokes, stroke], future: [] });
}

export const addCorner = (draft: Draft<Painted>, corner: Place) => void (draft.value = { ...draft.value, corners: [...draft.value.corners, corner] });

/** Take back the last corner that was set, or the last stroke. */
export async function undoStroke(floor: number, draft: Draft<Painted>): Promise<void> {
  const { strokes, future, corners } = draft.value;
  const last = strokes.at(-1);
  if (corners.length) draft.value = { ...draft.value, corners: corners.slice(0, -1) };
  else if (last) await attemptWith(floor, draft, { ...draft.value, strokes: strokes.slice(0, -1), future: [...future, last] });
}

export async function redoStroke(floor: number, draft: Draft<Painted>): Promise<void> {
  const { strokes, future } = draft.value;
  const next = future.at(-1);
  if (next) await attemptWith(floor, draft, { ...draft.value, strokes: [...strokes, next], future: future.slice(0, -1) });
}

export const beginAnew = (floor: number, draft: Draft<Painted>) => attemptWith(floor, draft, { ...NOTHING, anew: true });

/** Let the map be as it is without this tool; what is painted stays a draft. */
export function leaveWalls(): void {
  latest++;
  walls.view = null;
  overlay.clear();
}

/** Show what can be walked, and let the map be drawn on; to be called in an effect. */
export function showWalls(floor: number, draft: Draft<Painted>, attempt: (work: () => Promise<void>) => unknown): void {
  const { view, tool, walkable } = walls;
  const { corners } = draft.value;
  const colour = walkable ? COLOUR.open : COLOUR.closed;
  overlay.drawing = tool === 'none' ? null : { shape: tool, colour, done: (points) => void attempt(() => paint(floor, draft, points)) };
  const features: Feature[] = view?.floor === floor && view.rings.length ? [areaFeature(view.rings, COLOUR.open)] : [];
  if (corners.length > 1) {
    const line = new Feature(new LineString(corners));
    line.setStyle(new Style({ stroke: new Pen({ color: colour, width: 3 }) }));
    features.push(line);
  }
  overlay.features = features;
}
