// What the reader of the page chose: floor, walk, moment, filter and how walks are drawn.
import { data } from './data.svelte';
import type { Session } from '../api/model';
import type { ColourBy } from '../map/colours';
import type { Column } from './walk_rows';

export type Tab = 'prepare' | 'walks' | 'diagnose' | 'landmarks' | 'radio' | 'collect' | 'corrections' | 'compare' | 'share';
/** What one does with a survey, in the order in which it is done. */
export type Stage = 'prepare' | 'collect' | 'check' | 'data' | 'share';
export const VIEWS: Record<Stage, Tab[]> = {
  prepare: ['prepare'],
  collect: ['collect'],
  check: ['walks', 'diagnose', 'landmarks', 'corrections', 'compare'],
  data: ['radio'],
  share: ['share'],
};
/** A step of preparing a building. */
export type Step = 'plan' | 'walls' | 'landmarks' | 'sheets' | 'positions';
export type Spot = { floor: number; x: number; y: number };

class Choice {
  tab = $state<Tab>('walks');
  /** The open step of preparing; undefined: none was opened or closed yet. */
  step = $state<Step | null | undefined>();
  floor = $state(0);
  stacked = $state(false);
  turn = $state(0.5);
  colourBy = $state<ColourBy>('status');
  showScans = $state(false);
  showBand = $state(false);
  showEvents = $state(true);
  layers = $state<Record<string, boolean>>({});
  /** Kinds of the legend that are not drawn. */
  hidden = $state<Record<string, boolean>>({});

  text = $state('');
  /** Whether walks of other floors than the chosen one are left out of the list. */
  onlyFloor = $state(false);
  sortBy = $state<Column>('name');
  descending = $state(false);
  filterDevice = $state('');
  filterDate = $state('');
  filterFinding = $state('');

  /** What tells the correction that stands out from others. */
  entry = $state<string | null>(null);

  /** What landmarks and access points are searched by. */
  landmarkText = $state('');
  radioText = $state('');

  /** Id of the session that stands out. */
  session = $state<string | null>(null);
  /** Id of the one that stood out last. */
  lastSession = $state<string | null>(null);
  /** Seconds after its first frame. */
  time = $state(0);
  /** Whether its moment is to be brought into view once it is loaded. */
  centred = false;
  /** A part of the walk painted on the slider: from, to; seconds. */
  span = $state.raw<[number, number] | null>(null);
  /** A landmark or control point. */
  point = $state<{ kind: 'landmark' | 'control'; floor: number; id: string } | null>(null);
  /** Where the chosen landmark or control point was dragged to. */
  dragged = $state.raw<{ x: number; y: number } | null>(null);
  /** What the map is to show next, with a number so that the same may be asked for twice. */
  goal = $state.raw<{ spots: Spot[] } | null>(null);
  /** Share of the map's width that the left of two compared outputs takes; null: not compared. */
  swipe = $state<number | null>(null);
  other = $state('');

  listed = $derived(data.sessions.filter((session) => this.matches(session)));
  current = $derived(this.session === null ? null : (data.byId.get(this.session) ?? null));

  private matches(session: Session): boolean {
    const words = [session.key.session, session.key.device, session.slug, ...session.landmarks].join(' ').toLowerCase();
    return (
      words.includes(this.text.trim().toLowerCase()) &&
      (!this.onlyFloor || session.key.floor === this.floor || session.floors.includes(this.floor)) &&
      (!this.filterDevice || session.key.device === this.filterDevice) &&
      (!this.filterDate || session.date === this.filterDate) &&
      (!this.filterFinding || this.filterFinding in session.findings)
    );
  }
}

export const choice = new Choice();

export function chooseSession(id: string | null): void {
  choice.session = id;
  if (id !== null) choice.lastSession = id;
  [choice.time, choice.span, choice.centred] = [0, null, false];
  const session = id === null ? undefined : data.byId.get(id);
  if (!session) return;
  if (!session.floors.includes(choice.floor)) choice.floor = session.floors[0] ?? session.key.floor;
  showWalk(session);
}

/** Bring a walk's positions on the chosen floor into view. */
export function showWalk(session: Session): void {
  const bounds = session.bounds[String(choice.floor)];
  if (bounds) show([{ floor: choice.floor, x: bounds[0], y: bounds[2] }, { floor: choice.floor, x: bounds[1], y: bounds[3] }]);
}

/** Bring places into view; the floor becomes that of the first. */
export function show(spots: Spot[]): void {
  if (!spots.length) return;
  choice.floor = spots[0].floor;
  choice.goal = { spots };
}
