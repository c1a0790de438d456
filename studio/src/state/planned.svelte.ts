// Planned landmarks, which can be dragged: the map of the error to expect follows, of several changes the latest counts.
import type Feature from 'ol/Feature';
import * as api from '../api/client';
import type { PlanChange, PlanWish, Planned as View, Rooms } from '../api/model';
import { areaFeature, plannedFeature } from '../map/marks';
import { pictureOf } from '../map/raster';
import { choice } from './choice.svelte';
import { type Draft, paintedDraft } from './drafts.svelte';
import { type Place, overlay } from './overlay.svelte';

type Held = View['landmarks'];

/** A plan that is not written: what was asked for, its landmarks, and the error expected when it was made. */
interface Kept {
  wish: PlanWish;
  plan: number;
  landmarks: Held;
  first_m: number | null;
}
export type PlanDraft = Draft<Kept | null>;

/** The plan of a floor that is not written; `address` is that of the floor's plan, which changes with it. */
export const plannedOn = (floor: number, address: string): PlanDraft => paintedDraft<Kept | null>('landmarks', String(floor), null, address);

const EXCLUDED = '#57606a';

class Planned {
  view = $state.raw<View | null>(null);
  /** What was expected when the plan was made. */
  first = $state.raw<View | null>(null);
  past = $state.raw<Held[]>([]);
  chosen = $state<string | null>(null);
  dragging = $state(false);
  draft = $state.raw<PlanDraft | null>(null);
  rooms = $state.raw<Rooms | null>(null);
  /** Whether a click on the map leaves a room out, or lets it count again. */
  choosing = $state(false);

  /** Sigmas of the two ends of the colours (m). */
  ends = $derived<[number, number]>([0, Math.max(0.2, Math.ceil(Math.max(...(this.first?.sigma_cm ?? [])) / 10) / 10)]);
}

export const planned = new Planned();

let next: PlanChange | null = null;
let asking: Promise<void> | null = null;

/** Ask for a change; while one is computed only the latest of the others waits. */
function ask(change: PlanChange): Promise<void> {
  next = change;
  asking ??= askAll().finally(() => ([asking, next] = [null, null]));
  return asking;
}

async function askAll(): Promise<void> {
  while (next) {
    const asked: PlanChange = next;
    next = null;
    const view = await api.changePlan(asked);
    if (planned.view?.plan === asked.plan) hold(view);
  }
}

/** Show a plan and keep it as a draft. */
function hold(view: View): void {
  planned.view = view;
  const { draft } = planned;
  if (draft?.value) draft.value = { ...draft.value, plan: view.plan, landmarks: view.landmarks };
}

const held = (landmarks: Held) => landmarks.map(({ id, place }) => ({ id, place }));
const asHeld = (plan: number, landmarks: Held): PlanChange => ({ plan, landmarks: held(landmarks), moved: null, to: null });

function begun(view: View, first: View): void {
  [planned.view, planned.first, planned.past, planned.chosen] = [view, first, [], null];
}

export async function plan(wish: PlanWish, draft: PlanDraft): Promise<void> {
  const view = await api.plan(wish);
  draft.discard(null, draft.now);
  draft.value = { wish, plan: view.plan, landmarks: view.landmarks, first_m: view.expected_error_m };
  planned.draft = draft;
  begun(view, view);
}

/** Show the draft of a floor again. Returns false if its landmarks are no places of the floor any more. */
export async function showAgain(draft: PlanDraft): Promise<boolean> {
  const kept = draft.value;
  if (!kept) return true;
  planned.draft = draft;
  if (planned.view?.plan === kept.plan && planned.view.landmarks === kept.landmarks) return true; // only the tab was left
  const fits = (view: View) => view.floor === kept.wish.floor && JSON.stringify(view.landmarks) === JSON.stringify(kept.landmarks);
  const again = async (number: number) => {
    const view = await api.changePlan(asHeld(number, kept.landmarks));
    if (!fits(view) || planned.draft !== draft) return false;
    begun(view, { ...view, expected_error_m: kept.first_m });
    hold(view);
    return true;
  };
  // The server remembers a few plans while it runs; else the same wish makes the same places.
  const known = await again(kept.plan).catch(() => false);
  return known || planned.draft !== draft || again((await api.plan(kept.wish)).plan);
}

/** Leave out the room at a place, or let it count again; without a place only look. */
export async function excludeRoom(floor: number, at: Place | null): Promise<void> {
  planned.rooms = await api.rooms({ floor, at });
}

function begin(): Held {
  const { landmarks } = planned.view!;
  planned.past = [...planned.past, landmarks];
  return landmarks;
}

/** Move a landmark to the place nearest to a point; null: add one there. */
export async function moveTo(moved: string | null, to: Place): Promise<void> {
  await ask({ plan: planned.view!.plan, landmarks: held(begin()), moved, to });
  planned.chosen = moved ?? planned.view!.landmarks.at(-1)!.id;
}

export async function takeAway(id: string): Promise<void> {
  const left = begin().filter((landmark) => landmark.id !== id);
  planned.chosen = null;
  await ask({ plan: planned.view!.plan, landmarks: held(left), moved: null, to: null });
}

export async function takeBack(): Promise<void> {
  const before = planned.past.at(-1);
  if (!before) return;
  planned.past = planned.past.slice(0, -1);
  await ask(asHeld(planned.view!.plan, before));
}

/** Add the landmarks to the survey; returns how many. */
export async function write(draft: PlanDraft): Promise<number> {
  const { plan: number, landmarks } = planned.view!;
  const { count } = await api.writePlan(asHeld(number, landmarks));
  forgetPlan(draft);
  return count;
}

export function forgetPlan(draft: PlanDraft): void {
  draft.discard(null, draft.now);
  [planned.view, planned.first, planned.past] = [null, null, []];
  overlay.clear();
}

/** Show the plan on the map; to be called in an effect. `failed` hears of what goes wrong while one is dragged. */
export function showPlan(dark: boolean, attempt: (work: () => Promise<void>) => Promise<unknown>): void {
  const { view, ends, chosen, rooms, choosing } = planned;
  const floor = choice.floor;
  const excluded = rooms?.floor === floor ? rooms.excluded.filter(({ rings }) => rings.length).map(({ rings }) => areaFeature(rings, EXCLUDED)) : [];
  overlay.clicked = choosing ? (at) => void attempt(() => excludeRoom(floor, at)) : null;
  if (!view || view.floor !== floor) {
    [overlay.pictures, overlay.features] = [[], excluded];
    return;
  }
  const cells = Float32Array.from(view.sigma_cm, (value) => (value < 0 ? NaN : value / 100));
  overlay.pictures = [pictureOf({ floor: view.floor, extent: view.extent_m, rows: view.rows, columns: view.columns, cells }, ends, null)];
  if (planned.dragging) return; // the feature that is being dragged must stay
  const marks = view.landmarks.map((landmark): Feature => {
    const feature = plannedFeature(landmark, landmark.id === chosen, dark);
    let before: Held | null = null;
    feature.set('press', () => (planned.chosen = landmark.id));
    feature.set('drag', (to: Place, ended: boolean) => {
      if (!before) planned.past = [...planned.past, (before = view.landmarks)];
      planned.dragging = true;
      const asked = attempt(() => ask({ plan: view.plan, landmarks: held(view.landmarks), moved: landmark.id, to: [to[0], to[1]] }));
      if (ended) void asked.then(() => ([planned.dragging, planned.chosen] = [false, landmark.id]));
    });
    return feature;
  });
  overlay.features = [...excluded, ...marks];
}
