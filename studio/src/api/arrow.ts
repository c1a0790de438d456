// Columns of the server's Arrow streams as typed arrays.
import { tableFromIPC } from '@uwdata/flechette';

/** Frames or scans, one row each; columns that a stream lacks are empty. Units: docs of the API. */
export interface Track {
  rows: number;
  stride: number;
  session: Uint16Array;
  path: Uint32Array;
  frame: Uint32Array;
  t: Float32Array;
  floor: Int16Array;
  x: Float32Array;
  y: Float32Array;
  z: Float32Array;
  status: Uint8Array;
  sigma: Float32Array;
  speed: Float32Array;
  heading: Float32Array;
  cov_xx: Float32Array;
  cov_xy: Float32Array;
  cov_yy: Float32Array;
}

/** One chart: its number, times (s) and values. */
export interface Series {
  number: number;
  t: Float32Array;
  v: Float32Array;
}

export type Columns = Map<string, ArrayLike<number>>;

function columns(buffer: ArrayBuffer): Columns {
  const table = tableFromIPC(new Uint8Array(buffer));
  return new Map(table.names.map((name) => [String(name), table.getChild(name).toArray() as ArrayLike<number>]));
}

export const readTrack = (buffer: ArrayBuffer, stride: number): Track => trackOf(columns(buffer), stride);

export function trackOf(found: Columns, stride: number): Track {
  const f32 = (name: string) => Float32Array.from(found.get(name) ?? []);
  const session = Uint16Array.from(found.get('session') ?? []);
  return {
    rows: session.length,
    stride,
    session,
    path: Uint32Array.from(found.get('path') ?? []),
    frame: Uint32Array.from(found.get('frame') ?? []),
    t: f32('t'),
    floor: Int16Array.from(found.get('floor') ?? []),
    x: f32('x'),
    y: f32('y'),
    z: f32('z'),
    status: Uint8Array.from(found.get('status') ?? []),
    sigma: f32('sigma'),
    speed: f32('speed'),
    heading: f32('heading'),
    cov_xx: f32('cov_xx'),
    cov_xy: f32('cov_xy'),
    cov_yy: f32('cov_yy'),
  };
}

export const readSeries = (buffer: ArrayBuffer): Series[] => seriesOf(columns(buffer));

export function seriesOf(found: Columns): Series[] {
  const number = Uint8Array.from(found.get('series') ?? []);
  const t = Float32Array.from(found.get('t') ?? []);
  const v = Float32Array.from(found.get('v') ?? []);
  return runs(number).map(([from, to]) => ({ number: number[from], t: t.slice(from, to), v: v.slice(from, to) }));
}

export const readCells = (buffer: ArrayBuffer): Float32Array => Float32Array.from(columns(buffer).get('v') ?? []);

/** [from, to) of each run of equal values. */
export function runs(values: ArrayLike<number>): [number, number][] {
  const found: [number, number][] = [];
  for (let from = 0, to = 1; from < values.length; to++) {
    if (to < values.length && values[to] === values[from]) continue;
    found.push([from, to]);
    from = to;
  }
  return found;
}
