// A plan that was dropped and has no scale yet: what is clicked on it, and the floor that it becomes.
import Feature from 'ol/Feature';
import { LineString, Point } from 'ol/geom';
import { Circle, Fill, Stroke, Style } from 'ol/style';
import * as api from '../api/client';
import type { PlanLook } from '../api/model';
import { rectangle } from '../map/marks';
import type { Plan } from '../map/paint';
import { loadPicture } from '../map/plans';
import { choice } from './choice.svelte';
import { type Place, overlay } from './overlay.svelte';

/** A dropped plan is drawn so large, whatever its units (m on the map). */
const SIDE = 100;
const LINE = '#d55e00';
const AREA = '#0550ae';

export type ScaleBy = 'distance' | 'paper' | 'file';

class Draft {
  file = $state<number | null>(null);
  look = $state.raw<PlanLook | null>(null);
  page = $state(1);
  level = $state('');
  /** In the plan's own coordinates. */
  points = $state.raw<Place[]>([]);
  metres = $state('');
  by = $state<ScaleBy>('distance');
  oneTo = $state('100');
  /** Only the building on the page, without frame and margins. */
  building = $state(true);
  floor = $state(1);
  name = $state('');
  picture = $state.raw<Plan['image'] | null>(null);

  typed = $derived(Number(this.metres.trim().replace(',', '.')));
  ready = $derived(this.by === 'file' || (this.by === 'paper' ? Number(this.oneTo) > 0 : this.points.length === 2 && this.typed > 0));

  private get size(): [number, number, number] {
    const [left, right, low, high] = this.look!.box;
    return [right - left, high - low, SIDE / Math.max(right - left, high - low)];
  }

  toMap([x, y]: number[]): Place {
    const [left, , low, high] = this.look!.box;
    const [, , scale] = this.size;
    return [(x - left) * scale, (this.look!.downwards ? high - y : y - low) * scale];
  }

  toPlan([x, y]: Place): Place {
    const [left, , low, high] = this.look!.box;
    const [width, , scale] = this.size;
    const digits = Math.min(9, Math.max(0, 3 - Math.floor(Math.log10(width / 2000)) - 1));
    const round = (value: number) => Number(value.toFixed(digits));
    return [round(left + x / scale), round(this.look!.downwards ? high - y / scale : low + y / scale)];
  }

  /** Take a click: the first or second point; a third begins anew. */
  click(place: Place): void {
    const point = this.toPlan(place);
    this.points = this.points.length === 1 ? [...this.points, point] : [point];
  }

  get extent(): number[] {
    const [width, height, scale] = this.size;
    return [0, width * scale, 0, height * scale];
  }

  get area(): [number, number, number, number] | null {
    const box = this.look?.building;
    const round = (value: number) => Math.round(value * 10) / 10;
    return box && this.building ? [round(box[0]), round(box[2]), round(box[1]), round(box[3])] : null;
  }
}

export const draft = new Draft();

export async function take(file: File, floor: number): Promise<void> {
  const { id } = await api.drop(file);
  [draft.file, draft.page, draft.level, draft.points, draft.metres, draft.building, draft.floor, draft.name] = [id, 1, '', [], '', true, floor, ''];
  await lookAt();
}

/** Look at the chosen page or level of the dropped file. */
export async function lookAt(): Promise<void> {
  const [id, page, level] = [draft.file!, draft.page, draft.level];
  draft.points = [];
  try {
    const look = await api.look(id, page, level);
    draft.picture = await loadPicture(api.pictureOf(id, page, level));
    draft.look = look;
    draft.level ||= look.levels[0] ?? '';
    draft.by = look.has_scale ? 'file' : 'distance';
  } catch (error) {
    if (!draft.look) draft.file = null;
    throw error;
  }
  overlay.box = [0, 0, draft.extent[1], draft.extent[3]];
}

export function forget(): void {
  [draft.file, draft.look, draft.picture, draft.points] = [null, null, null, []];
  overlay.clear();
}

/** Make it a floor of the survey. */
export async function addFloor(): Promise<string[]> {
  const { by, points, area } = draft;
  const scale =
    by === 'distance' ? { distance: { from: points[0], to: points[1], metres: draft.typed } } : by === 'paper' ? { scale: { one_to: Number(draft.oneTo) } } : {};
  const plan = { file: draft.look!.name, page: draft.page, level: draft.level || null, area, ...scale };
  const { floor, notes } = await api.addFloor({ file: draft.file!, whole: !draft.building, part: { number: draft.floor, name: draft.name, plan } });
  choice.floor = floor;
  return notes;
}

const line = (color: string) => new Style({ stroke: new Stroke({ color, width: 2.5 }) });

/** Show the plan with what was clicked on it; points can be dragged. To be called in an effect. */
export function showDraft(): void {
  if (!draft.look || !draft.picture) return;
  overlay.alone = true;
  overlay.pictures = [{ floor: choice.floor, image: draft.picture, extent: draft.extent }];
  overlay.clicked = draft.by === 'distance' ? (place) => draft.click(place) : null;
  const features: Feature[] = [];
  if (draft.area) {
    const [x0, y0, x1, y1] = draft.area;
    const frame = new Feature(rectangle(draft.toMap([x0, y0]), draft.toMap([x1, y1])));
    frame.setStyle(line(AREA));
    features.push(frame);
  }
  if (draft.by === 'distance') {
    const places = draft.points.map((point) => draft.toMap(point));
    if (places.length === 2) {
      const between = new Feature(new LineString(places));
      between.setStyle(line(LINE));
      features.push(between);
    }
    places.forEach((place, number) => {
      const point = new Feature(new Point(place));
      point.setStyle(new Style({ image: new Circle({ radius: 8, declutterMode: 'none', fill: new Fill({ color: 'rgba(255,255,255,0.4)' }), stroke: new Stroke({ color: LINE, width: 3 }) }) }));
      point.set('drag', (to: Place, ended: boolean) => {
        if (ended) draft.points = draft.points.map((old, of) => (of === number ? draft.toPlan(to) : old));
      });
      features.push(point);
    });
  }
  overlay.features = features;
}
