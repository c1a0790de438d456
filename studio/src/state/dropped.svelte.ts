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
import { type Draft, formDraft } from './drafts.svelte';
import { type Place, overlay } from './overlay.svelte';

/** A dropped plan is drawn so large, whatever its units (m on the map). */
const SIDE = 100;
const LINE = '#d55e00';
const AREA = '#0550ae';

export type ScaleBy = 'distance' | 'paper' | 'file';

/** What was dropped, clicked and typed: a draft, which a reload keeps. */
interface Typed {
  file: number | null;
  /** Name of the file, by which it is known again. */
  called: string;
  page: number;
  level: string;
  /** In the plan's own coordinates. */
  points: Place[];
  metres: string;
  by: ScaleBy;
  oneTo: string;
  /** Only the building on the page, without frame and margins. */
  building: boolean;
  floor: number;
  name: string;
}
const NOTHING: Typed = { file: null, called: '', page: 1, level: '', points: [], metres: '', by: 'distance', oneTo: '100', building: true, floor: 1, name: '' };

class DroppedPlan {
  look = $state.raw<PlanLook | null>(null);
  picture = $state.raw<Plan['image'] | null>(null);

  /** What is kept of it. */
  get kept(): Draft<Typed> {
    return formDraft('floor', '', NOTHING);
  }
  get of(): Typed {
    return this.kept.value;
  }
  get typed(): number {
    return Number(this.of.metres.trim().replace(',', '.'));
  }
  get ready(): boolean {
    const { by, oneTo, points } = this.of;
    return by === 'file' || (by === 'paper' ? Number(oneTo) > 0 : points.length === 2 && this.typed > 0);
  }

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
    this.of.points = this.of.points.length === 1 ? [...this.of.points, point] : [point];
  }

  get extent(): number[] {
    const [width, height, scale] = this.size;
    return [0, width * scale, 0, height * scale];
  }

  /** Width and height of what becomes the floor, by its scale (m); null: it has none yet. */
  get sizeInMetres(): [number, number] | null {
    if (!this.look || !this.ready) return null;
    const { box, building, size_m: size, paper_m: paper } = this.look;
    const { by, points, oneTo } = this.of;
    const [[x0, y0], [x1, y1]] = points.length === 2 ? points : [[0, 0], [0, 0]];
    const metres = { distance: this.typed / Math.hypot(x1 - x0, y1 - y0), paper: (paper ?? NaN) * Number(oneTo), file: (size?.[0] ?? NaN) / (box[1] - box[0]) }[by];
    const [left, right, low, high] = this.of.building && building ? building : box;
    return Number.isFinite(metres) ? [(right - left) * metres, (high - low) * metres] : null;
  }

  get area(): [number, number, number, number] | null {
    const box = this.look?.building;
    const round = (value: number) => Math.round(value * 10) / 10;
    return box && this.of.building ? [round(box[0]), round(box[2]), round(box[1]), round(box[3])] : null;
  }
}

export const dropped = new DroppedPlan();

export async function take(file: File, floor: number): Promise<void> {
  const { id, name } = await api.drop(file);
  Object.assign(dropped.of, NOTHING, { file: id, called: name, floor });
  await lookAt();
}

/** Look at the chosen page or level of the dropped file. */
export async function lookAt(): Promise<void> {
  const { of } = dropped;
  of.points = [];
  try {
    const look = await load();
    of.by = look.size_m ? 'file' : 'distance';
  } catch (error) {
    if (!dropped.look) forget();
    throw error;
  }
}

/** Show the plan of a draft again; the server keeps its file while it runs. Returns false if it is not there any more. */
export async function lookAgain(): Promise<boolean> {
  try {
    await load();
    return dropped.look?.name === dropped.of.called;
  } catch (error) {
    if (error instanceof api.Refusal && error.problem.code === 'not_found') return false;
    throw error;
  }
}

async function load(): Promise<PlanLook> {
  const { of } = dropped;
  const [id, page, level] = [of.file!, of.page, of.level];
  const look = await api.look(id, page, level);
  dropped.picture = await loadPicture(api.pictureOf(id, page, level));
  dropped.look = look;
  of.level ||= look.levels[0] ?? '';
  return look;
}

export function forget(): void {
  dropped.kept.discard(NOTHING);
  [dropped.look, dropped.picture] = [null, null];
  overlay.clear();
}

/** Make it a floor of the survey. */
export async function addFloor(): Promise<string[]> {
  const { by, points, file, page, level, oneTo, building, floor: number, name } = dropped.of;
  const scale =
    by === 'distance' ? { distance: { from: points[0], to: points[1], metres: dropped.typed } } : by === 'paper' ? { scale: { one_to: Number(oneTo) } } : {};
  const plan = { file: dropped.look!.name, page, level: level || null, area: dropped.area, ...scale };
  const { floor, notes } = await api.addFloor({ file: file!, whole: !building, part: { number, name, plan } });
  choice.floor = floor;
  return notes;
}

const line = (color: string) => new Style({ stroke: new Stroke({ color, width: 2.5 }) });

/** Show the plan with what was clicked on it; points can be dragged. To be called in an effect. */
export function showDropped(): void {
  if (!dropped.look || !dropped.picture) return;
  overlay.alone = true;
  overlay.pictures = [{ floor: choice.floor, image: dropped.picture, extent: dropped.extent }];
  overlay.clicked = dropped.of.by === 'distance' ? (place) => dropped.click(place) : null;
  const features: Feature[] = [];
  if (dropped.area) {
    const [x0, y0, x1, y1] = dropped.area;
    const frame = new Feature(rectangle(dropped.toMap([x0, y0]), dropped.toMap([x1, y1])));
    frame.setStyle(line(AREA));
    features.push(frame);
  }
  if (dropped.of.by === 'distance') {
    const places = dropped.of.points.map((point) => dropped.toMap(point));
    if (places.length === 2) {
      const between = new Feature(new LineString(places));
      between.setStyle(line(LINE));
      features.push(between);
    }
    places.forEach((place, number) => {
      const point = new Feature(new Point(place));
      point.setStyle(new Style({ image: new Circle({ radius: 8, declutterMode: 'none', fill: new Fill({ color: 'rgba(255,255,255,0.4)' }), stroke: new Stroke({ color: LINE, width: 3 }) }) }));
      point.set('drag', (to: Place, ended: boolean) => {
        if (ended) dropped.of.points = dropped.of.points.map((old, of) => (of === number ? dropped.toPlan(to) : old));
      });
      features.push(point);
    });
  }
  overlay.features = features;
}
