// What a panel lays over the map for as long as it is at work: pictures, features to drag or press, clicks and drawing.
import type Feature from 'ol/Feature';
import type { Plan } from '../map/paint';

export type Place = [x: number, y: number];
export interface Drawing {
  shape: 'brush' | 'polygon';
  colour: string;
  done(points: Place[]): void;
}

class Overlay {
  pictures = $state.raw<Plan[]>([]);
  /** With a function as property `drag` (place, ended) or `press`. */
  features = $state.raw<Feature[]>([]);
  /** Paths that the chosen walk may have taken, below the features. */
  paths = $state.raw<Feature[]>([]);
  /** Whether nothing else is drawn: plan, landmarks and walks are left out. */
  alone = $state(false);
  /** Box [left, low, right, high] to bring into view. */
  box = $state.raw<number[] | null>(null);
  clicked = $state.raw<((place: Place) => void) | null>(null);
  drawing = $state.raw<Drawing | null>(null);
  /** Where the middle of the map is, for those who have no mouse. */
  middle: () => Place = () => [0, 0];

  clear(): void {
    [this.pictures, this.features, this.alone, this.box, this.clicked, this.drawing] = [[], [], false, null, null, null];
  }
}

export const overlay = new Overlay();
