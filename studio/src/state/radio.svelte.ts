// The radio map that is shown: which layer of which access point, and from which value on.
import * as api from '../api/client';
import type { Radio, RadioFloor, RadioPoint } from '../api/model';
import { type Raster, pictureOf } from '../map/raster';
import { choice } from './choice.svelte';
import { data } from './data.svelte';
import { latest } from './latest';

export const LAYERS = ['strongest', 'number', 'mean_dbm', 'heard', 'deviation_db', 'sigma_db'] as const;
export type Layer = (typeof LAYERS)[number];
/** Ends of the colours of each layer, in its unit. */
export const ENDS: Record<Layer, [number, number]> = {
  strongest: [-90, -40],
  number: [0, 30],
  mean_dbm: [-90, -40],
  heard: [0, 1],
  deviation_db: [0, 10],
  sigma_db: [0, 5],
};
const OF_ALL: Layer[] = ['strongest', 'number'];

class RadioState {
  view = $state.raw<Radio | null>(null);
  layer = $state<Layer>('strongest');
  technology = $state('');
  bssid = $state('');
  /** Cells with less are not drawn; null: all are. */
  least = $state<number | null>(null);
  raster = $state.raw<Raster | null>(null);

  technologies = $derived([...new Set((this.view?.floors ?? []).map(({ technology }) => technology))]);
  floor = $derived<RadioFloor | null>(
    this.view?.floors.find(({ floor, technology }) => floor === choice.floor && technology === (this.technology || this.technologies[0])) ?? null,
  );
  points = $derived<RadioPoint[]>(this.floor?.access_points ?? []);
  /** What is laid over the plan. */
  picture = $derived(this.raster && this.raster.floor === choice.floor ? pictureOf(this.raster, ENDS[this.layer], this.least) : null);
  /** Share of the known cells that are drawn. */
  share = $derived.by(() => {
    const known = this.raster?.cells.filter((value) => !Number.isNaN(value));
    const { least } = this;
    return known?.length ? (least === null ? 1 : known.filter((value) => value >= least).length / known.length) : null;
  });
}

export const radio = new RadioState();

/** Choose an access point, and a layer of its own where one of all was shown. */
export function choosePoint(bssid: string): void {
  radio.bssid = bssid;
  if (OF_ALL.includes(radio.layer)) [radio.layer, radio.least] = ['mean_dbm', null];
}

/** Fetch the chosen map whenever the choice changes; to be called in a component. */
export function followRadio(): void {
  $effect(() => {
    void [data.generation, data.job];
    return latest(api.radio, (view) => (radio.view = view));
  });
  $effect(() => {
    const { floor, layer, bssid } = radio;
    const chosen = OF_ALL.includes(layer) || radio.points.some((point) => point.bssid === bssid);
    if (!floor || !chosen) {
      radio.raster = null;
      return;
    }
    return latest(
      () => api.radioMap(floor.floor, floor.technology, layer, bssid),
      (cells) => (radio.raster = { floor: floor.floor, extent: floor.extent_m, rows: floor.rows, columns: floor.columns, cells }),
    );
  });
  $effect(() => () => (radio.raster = null));
}
