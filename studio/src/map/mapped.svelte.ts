// What the map loads: plans, frames of the part in view, shapes of layers, and the walks of an output to compare with.
import type { Track } from '../api/arrow';
import * as api from '../api/client';
import type { Feature } from '../api/model';
import { choice } from '../state/choice.svelte';
import { data } from '../state/data.svelte';
import { latest } from '../state/latest';
import { overlay } from '../state/overlay.svelte';
import { theme } from '../state/theme.svelte';
import { type Placing, flat, stacked } from './affine';
import { outlineOf } from './ground';
import { largestMoves } from './moves';
import type { Plan } from './paint';
import { planOf } from './plans';

/** So many frames are fetched for a window at most. */
const WINDOW_POINTS = 200_000;
/** Frames are fetched once the map has rested so long (ms). */
const PAUSE_MS = 120;
const MOST_MOVES = 60;

interface Answer<T> {
  /** What was asked for. */
  of: string;
  is: T;
}

class Mapped {
  /** Part of the map that is in view: left, low, right, high. */
  extent = $state.raw<number[] | null>(null);
  /** Metres per pixel. */
  resolution = $state(0);
  plans = $state.raw<Plan[]>([]);
  private window = $state.raw<Answer<Track | null> | null>(null);
  private compared = $state.raw<Answer<Track> | null>(null);
  private layers = $state.raw<Record<string, Answer<Feature[]>>>({});

  floors = $derived(data.survey?.floors ?? []);
  placing = $derived<Placing>(choice.stacked && !overlay.alone ? stacked(this.floors, choice.turn, 0.6) : flat(choice.floor));
  private drawn = $derived(`${data.output} ${data.generation} ${choice.floor}`);
  /** Floors of the survey that are shown. */
  private numbers = $derived(this.floors.flatMap(({ number }) => (this.placing.has(number) ? number : [])).join());
  private otherDrawn = $derived(choice.swipe === null ? '' : choice.other);

  /** The walks: with all frames in view once they are loaded. */
  track = $derived(!choice.stacked && this.window?.of === this.drawn && this.window.is ? this.window.is : data.overview);
  other = $derived(this.otherDrawn && this.compared?.of === this.otherDrawn ? this.compared.is : null);
  moves = $derived(this.other && data.overview ? largestMoves(data.overview, this.other, [...this.placing.keys()], MOST_MOVES, 2) : []);
  /** Shapes of the chosen layers on the placed floors. */
  features = $derived(data.layers.flatMap(({ name, title }) => (choice.layers[name] && this.layers[name]?.of === this.numbers ? [{ name, title, features: this.layers[name].is }] : [])));
  /** Outlines of the walks on floors without a plan. */
  outlines = $derived.by(() => {
    const track = data.overview;
    const bare = this.floors.filter(({ plan, number }) => !plan && this.placing.has(number));
    return track ? bare.map(({ number }) => ({ floor: number, outline: outlineOf(track, number) })) : [];
  });

  /** Load what is shown; to be called in a component. */
  follow(): void {
    $effect(() => {
      const wanted = this.floors.filter(({ number }) => this.placing.has(number)).flatMap((floor) => planOf(floor, theme.dark) ?? []);
      return latest(() => Promise.all(wanted), (plans) => (this.plans = plans));
    });
    $effect(() => {
      const [of, extent, output, floor] = [this.drawn, this.extent, data.output, choice.floor];
      const enough = data.overview?.stride === 1 && !choice.showBand; // only frames of a window have covariances
      if (enough) this.window = null;
      if (choice.stacked || !extent || !data.overview || enough) return;
      return latest(() => api.frames(output, floor, widened(extent), WINDOW_POINTS), (is) => (this.window = { of, is }), PAUSE_MS);
    });
    $effect(() => {
      const of = this.otherDrawn;
      void data.generation;
      return of ? latest(() => api.overview(of), (is) => (this.compared = { of, is })) : undefined;
    });
    $effect(() => {
      for (const { name } of data.layers) $effect(() => this.followLayer(name));
    });
  }

  private followLayer(name: string): (() => void) | undefined {
    const of = this.numbers;
    void data.generation;
    if (!of || !choice.layers[name]) return undefined;
    return latest(() => Promise.all(of.split(',').map((floor) => api.features(name, Number(floor)))), (found) => (this.layers = { ...this.layers, [name]: { of, is: found.flat() } }));
  }
}

export const mapped = new Mapped();

/** A part of the map, and around it so much that it can be dragged a little. */
function widened([left, low, right, high]: number[]): number[] {
  const margin = 0.2 * (right - left);
  return [left - margin, low - margin, right + margin, high + margin];
}
