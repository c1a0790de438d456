// The chosen walk in full: frames, charts and the moments one can jump to.
import { type Series, type Track } from '../api/arrow';
import * as api from '../api/client';
import type { SessionDetail } from '../api/model';
import { choice, show } from './choice.svelte';
import { data } from './data.svelte';
import { latest } from './latest';

export interface Moment {
  t: number;
  kind: 'landmark' | 'event' | 'finding';
  text: string;
}

class Walk {
  detail = $state.raw<SessionDetail | null>(null);
  track = $state.raw<Track | null>(null);
  series = $state.raw<Series[]>([]);
  moments = $derived(momentsOf(this.detail));
  end = $derived(choice.current?.duration_s ?? 0);
  /** Row of the frame at the chosen time; -1 where there is none, as while the walk is mapped again. */
  row = $derived(this.track?.t.length ? rowAt(this.track.t, choice.time) : -1);
}

export const walk = new Walk();

export function momentsOf(detail: SessionDetail | null): Moment[] {
  if (!detail) return [];
  const contradicted = detail.contradictions.map(({ landmark }) => landmark);
  return [
    ...detail.visits.map(({ t, landmark }): Moment => ({ t, kind: contradicted.includes(landmark) ? 'finding' : 'landmark', text: landmark })),
    ...detail.events.map(({ t, kind }): Moment => ({ t, kind: 'event', text: kind })),
  ].sort((a, b) => a.t - b.t);
}

/** The next moment after (`direction` 1) or before (-1) a time, of a kind or of any. */
export function nextMoment(moments: Moment[], time: number, direction: 1 | -1, kind: Moment['kind'] | null): Moment | undefined {
  const fitting = moments.filter((moment) => (kind === null || moment.kind === kind || (kind === 'landmark' && moment.kind === 'finding')));
  return direction > 0 ? fitting.find(({ t }) => t > time + 0.01) : fitting.findLast(({ t }) => t < time - 0.01);
}

/** Last row whose time is not after `time`; times ascend. */
export function rowAt(times: Float32Array, time: number): number {
  let [low, high] = [0, times.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** Charts of angles: heading, and turn rate. */
const ANGLES = [1, 7];
/** Angles are shown in degrees. */
export const inDegrees = (series: Series): Series => (ANGLES.includes(series.number) ? { ...series, v: series.v.map((value) => (value * 180) / Math.PI) } : series);

/** Load the chosen walk whenever the choice or its labels change; to be called in a component. */
export function followChoice(): void {
  $effect(() => {
    const [id, output] = [choice.session, data.output];
    void [data.generation, data.corrections.version];
    if (id === null || !data.overview) { // with a link, all walks come first
      [walk.detail, walk.track, walk.series] = [null, null, []];
      return;
    }
    return latest(
      () => Promise.all([api.session(id), api.walk(id, output), api.series(id, output)]),
      ([detail, track, series]) => {
        [walk.detail, walk.track, walk.series] = [detail, track, series.map(inDegrees)];
        if (choice.centred) showMoment(track, walk.row);
        choice.centred = false;
      },
    );
  });
}

/** Half of the width that is shown around a moment, metres. */
const AROUND_M = 8;

/** Bring the place of a frame into view, in the middle. */
function showMoment({ x, y, floor }: Track, row: number): void {
  if (row < 0 || Number.isNaN(x[row])) return;
  show([-AROUND_M, AROUND_M].map((side) => ({ floor: floor[row], x: x[row] + side, y: y[row] + side })));
}
