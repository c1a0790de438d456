// Corrections of where a floor can be walked: strokes of a brush and polygons, taken back one by one, then written.
import Feature from 'ol/Feature';
import { LineString } from 'ol/geom';
import { Stroke as Pen, Style } from 'ol/style';
import * as api from '../api/client';
import type { Stroke, Walls } from '../api/model';
import { areaFeature } from '../map/marks';
import { choice } from './choice.svelte';
import { type Place, overlay } from './overlay.svelte';

const COLOUR = { open: '#009e73', closed: '#d55e00' };

class WallsState {
  view = $state.raw<Walls | null>(null);
  strokes = $state.raw<Stroke[]>([]);
  future = $state.raw<Stroke[]>([]);
  /** Whether what was corrected before counts no more. */
  anew = $state(false);
  walkable = $state(false);
  tool = $state<'none' | Stroke['shape']>('none');
  width = $state(0.3);
  /** Corners that were set one by one. */
  corners = $state.raw<Place[]>([]);
}

export const walls = new WallsState();
let latest = 0;

/** Ask where the floor can be walked with the strokes; of several answers the last counts. */
export async function look(write = false): Promise<void> {
  const mine = ++latest;
  const view = await api.walls({ floor: choice.floor, strokes: walls.strokes, anew: walls.anew, write });
  if (mine !== latest) return;
  walls.view = view;
  if (write) [walls.strokes, walls.future, walls.anew] = [[], [], false];
}

/** Try strokes; where nothing could be walked with them they are not taken. */
async function attemptWith(strokes: Stroke[]): Promise<void> {
  const before = walls.strokes;
  walls.strokes = strokes;
  try {
    await look();
  } catch (error) {
    walls.strokes = before;
    throw error;
  }
}

export async function paint(points: Place[]): Promise<void> {
  const { tool, walkable, width } = walls;
  walls.corners = [];
  if (tool === 'none' || points.length < (tool === 'polygon' ? 3 : 2)) return;
  const thinned = points.filter((_, place) => points.length < 400 || place % Math.ceil(points.length / 400) === 0 || place === points.length - 1);
  await attemptWith([...walls.strokes, { walkable, shape: tool, points: thinned, width_m: width }]);
  walls.future = [];
}

export async function undoStroke(): Promise<void> {
  const last = walls.strokes.at(-1);
  if (!last) return;
  await attemptWith(walls.strokes.slice(0, -1));
  walls.future = [...walls.future, last];
}

export async function redoStroke(): Promise<void> {
  const next = walls.future.at(-1);
  if (!next) return;
  await attemptWith([...walls.strokes, next]);
  walls.future = walls.future.slice(0, -1);
}

/** Forget what is not written. */
export function forgetWalls(): void {
  latest++;
  [walls.view, walls.strokes, walls.future, walls.anew, walls.tool, walls.corners] = [null, [], [], false, 'none', []];
  overlay.clear();
}

/** Show what can be walked, and let the map be drawn on; to be called in an effect. */
export function showWalls(attempt: (work: () => Promise<void>) => unknown): void {
  const { view, tool, walkable, corners } = walls;
  const colour = walkable ? COLOUR.open : COLOUR.closed;
  overlay.drawing = tool === 'none' ? null : { shape: tool, colour, done: (points) => void attempt(() => paint(points)) };
  const features: Feature[] = view?.floor === choice.floor && view.rings.length ? [areaFeature(view.rings, COLOUR.open)] : [];
  if (corners.length > 1) {
    const line = new Feature(new LineString(corners));
    line.setStyle(new Style({ stroke: new Pen({ color: colour, width: 3 }) }));
    features.push(line);
  }
  overlay.features = features;
}
