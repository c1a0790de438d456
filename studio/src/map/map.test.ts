import { describe, expect, test } from 'vitest';
import type { Track } from '../api/arrow';
import type { Floor, Session, StatusStyle } from '../api/model';
import Feature from 'ol/Feature';
import { at, boxOf, flat, inverse, stacked } from './affine';
import { colouring, lookOf, shownColours, ticksOf } from './colours';
import { gridStep, hullOf, roundStep } from './ground';
import { explain, featureEntries, walkEntries, withoutHidden } from './legend';
import { largestMoves } from './moves';
import { nearestRow } from './pick';
import { stepOf } from './raster';
import { halfWidth, ribbons } from './ribbon';

const floor = (number: number): Floor => ({
  number,
  name: '',
  elevation_m: null,
  extent_m: [0, 20, 0, 10],
  plan: null,
  site_T_bcs: { rotation_rad: 0.3, shift_m: [5, -2] },
});

function track(x: number[], y: number[], session: number[] = x.map(() => 0)): Track {
  const none = new Float32Array();
  return {
    rows: x.length,
    stride: 1,
    session: Uint16Array.from(session),
    path: Uint32Array.from(session),
    frame: Uint32Array.from(x.keys()),
    t: Float32Array.from(x.keys()),
    floor: Int16Array.from(x, () => 0),
    x: Float32Array.from(x),
    y: Float32Array.from(y),
    z: none,
    status: Uint8Array.from(x, () => 7),
    sigma: Float32Array.from([0, 0.55, 5, NaN].slice(0, x.length)),
    speed: none,
    heading: none,
    cov_xx: none,
    cov_xy: none,
    cov_yy: none,
  };
}

const session = (index: number, frames: number, start: string | null = null) =>
  ({ index, id: `s${index}`, frames: { ok: frames }, start, key: { floor: 0, device: `d${index}`, session: `s${index}` } }) as unknown as Session;

describe('placing of floors', () => {
  test('the inverse takes a place of the map back to the floor', () => {
    const placed = stacked([floor(0), floor(1)], 0.7, 0.6).get(1)!;
    const [x, y] = at(inverse(placed), ...at(placed, 3.5, -4.25));
    expect([x, y]).toEqual([expect.closeTo(3.5, 9), expect.closeTo(-4.25, 9)]);
  });

  test('stacked floors keep their order upwards', () => {
    const placing = stacked([floor(0), floor(1), floor(2)], 1.2, 0.6);
    const heights = [0, 1, 2].map((number) => at(placing.get(number)!, 0, 0)[1]);
    expect(heights).toEqual([...heights].sort((a, b) => a - b));
  });

  test('a box is that of placed floors only', () => {
    expect(boxOf(flat(0), [{ floor: 0, extent: [1, 3, 2, 5] }, { floor: 1, extent: [-9, 9, -9, 9] }])).toEqual([1, 2, 3, 5]);
    expect(boxOf(flat(2), [{ floor: 0, extent: [1, 3, 2, 5] }])).toBeNull();
  });
});

describe('colours', () => {
  const statuses = [{ code: 7, label: 'uncertain', name: 'uncertain', colour: '#56b4e9', meaning: '', has_position: true }] as StatusStyle[];

  const ok = { code: 0, label: 'ok', name: 'ok', colour: '#0072b2', meaning: '', has_position: true };

  test('status takes the colour of the command line, uncertain positions another hue', () => {
    const colours = colouring('status', [], [ok, ...statuses], 1);
    expect(colours.looks[0]).toEqual({ colour: '#0072b2' });
    expect(colours.looks[colours.index(track([0], [0]), 0)]).toEqual({ colour: '#e69f00' });
  });

  test('more sessions than colours differ in dashes', () => {
    expect(new Set(Array.from({ length: 32 }, (_, place) => JSON.stringify(lookOf(place)))).size).toBe(32);
  });

  test('a scale has values with units between its ends', () => {
    expect(colouring('sigma', [], statuses, 1).ticks).toEqual(['0 m', '0.50 m', '≥ 1 m']);
    expect(ticksOf([-90, -40], String, 5)).toEqual(['-90', '-77.5', '-65', '-52.5', '-40']);
  });

  test('the legend has what is on the floor; what is hidden stays in it', () => {
    const colours = colouring('status', [], [ok, ...statuses], 1);
    const points = track([0, 1], [0, 0]);
    const keys = () => walkEntries(points, flat(0), Uint8Array.of(1), shownColours(colours, { 'status:uncertain': true }, false)).entries.map(({ key }) => key);
    expect(keys()).toEqual(['status:uncertain']);
    points.status[0] = 0;
    expect(keys()).toEqual(['status:ok', 'status:uncertain']);
    expect(walkEntries(points, flat(1), Uint8Array.of(1), colours).entries).toEqual([]);
    expect(shownColours(colours, { 'status:uncertain': true }, false).looks.map(({ colour }) => colour)).toEqual(['#0072b2', ...Array<undefined>(6), '#00000000']);
    const many = Array.from({ length: 15 }, (_, index) => session(index, 1));
    const all = track(many.map(() => 0), many.map(() => 0), many.map(({ index }) => index));
    expect(walkEntries(all, flat(0), new Uint8Array(15).fill(1), colouring('session', many, statuses, 1))).toMatchObject({ more: 3, entries: { length: 12 } });
    const entry = { key: 'landmark', text: 'landmark', symbol: 'diamond', colour: '#6639ba' } as const;
    const marks = [explain(new Feature(), entry), explain(new Feature(), entry), new Feature()];
    expect(featureEntries(marks)).toEqual([entry]);
    expect(withoutHidden(marks, { landmark: true })).toEqual([marks[2]]);
  });

  test('sigma grows through the palette, is held at the limit, and unknown is told apart', () => {
    const colours = colouring('sigma', [], statuses, 1);
    const points = track([0, 1, 2, 3], [0, 0, 0, 0]);
    expect([0, 1, 2, 3].map((row) => colours.index(points, row))).toEqual([0, 4, 7, 8]);
  });

  test('sessions of one device share a colour', () => {
    const sessions = [session(0, 1), session(1, 1), { ...session(2, 1), key: { floor: 0, device: 'd0', session: 's2' } }];
    const colours = colouring('device', sessions, statuses, 1);
    const points = track([0, 0, 0], [0, 0, 0], [0, 1, 2]);
    expect([0, 1, 2].map((row) => colours.index(points, row))).toEqual([0, 1, 0]);
  });

  test('age orders sessions by their start; one without a start is unknown', () => {
    const sessions = [session(0, 1, '2021-01-01T00:00:00'), session(1, 1, '2021-06-01T00:00:00'), session(2, 1)];
    const colours = colouring('age', sessions, statuses, 1);
    const points = track([0, 0, 0], [0, 0, 0], [0, 1, 2]);
    expect([0, 1, 2].map((row) => colours.index(points, row))).toEqual([0, 7, 8]);
  });
});

describe('95 % band', () => {
  test('it is as wide as the ellipse across a direction; an impossible covariance has none', () => {
    expect(halfWidth(4, 0, 1, [1, 0])).toBeCloseTo(2 * 2.4477, 9);
    expect(halfWidth(2.5, 1.5, 2.5, [Math.SQRT1_2, Math.SQRT1_2])).toBeCloseTo(2 * 2.4477, 9);
    expect(halfWidth(1, 5, 1, [1, 0])).toBeNaN();
  });

  test('one outline along a path, beside it by the half axis, broken where nothing is known', () => {
    const points = track([0, 1, 1.01, 2, 3, 4, 5], Array<number>(7).fill(0));
    const known = [1, 1, 1, 1, NaN, 1, 1];
    Object.assign(points, { cov_xx: Float32Array.from(known, (value) => 100 * value), cov_xy: Float32Array.from(known, (value) => 0 * value), cov_yy: Float32Array.from(known) });
    const found = ribbons(points, 0, 7, 0.5);
    expect(found.map((outline) => outline.map(([x]) => x))).toEqual([[0, 1, 2, 2, 1, 0], [4, 5, 5, 4]]);
    expect(found[0].map(([, y]) => y)).toEqual([1, 1, 1, -1, -1, -1].map((side) => expect.closeTo(2.4477 * side, 4)));
  });
});

test('a floor without plan gets a convex outline and a grid of round steps', () => {
  expect(hullOf([[0, 0], [2, 0], [1, 1], [2, 2], [0, 2], [1, 0]])).toEqual([[0, 0], [2, 0], [2, 2], [0, 2]]);
  expect(hullOf([[3, 1], [1, 1]])).toEqual([[1, 1], [3, 1]]);
  expect([0.03, 0.2, 0.21, 1, 1.5, 7, 45].map(roundStep)).toEqual([0.05, 0.2, 0.5, 1, 2, 10, 50].map((step) => expect.closeTo(step, 9)));
  expect(gridStep(0.1)).toBeCloseTo(5, 9);
});

test('the largest moves between two outputs, apart from each other, also between thinned frames', () => {
  const one = track([0, 1, 2, 3], [0, 0, 0, 0]);
  const other = { ...track([0, 2, 3.5], [1, 1, 3]), frame: Uint32Array.of(0, 2, 3) };
  const moves = largestMoves(one, other, [0], 2, 1.5);
  expect(moves.map(({ from, to }) => [from, to])).toEqual([[[3, 0], [3.5, 3]], [[0, 0], [0, 1]]]);
  expect(largestMoves(one, other, [0], 9, 0.5).map(({ from: [x] }) => x)).toEqual([3, 0, 1, 2]);
  expect(largestMoves(one, other, [1], 9, 0.5)).toEqual([]);
  expect(largestMoves(one, { ...other, session: Uint16Array.of(1, 1, 1) }, [0], 9, 0)).toEqual([]);
});

test('the nearest point of a walk that is shown is picked, within reach', () => {
  const points = track([0, 1, 1.2], [0, 0, 0], [0, 0, 1]);
  const placing = flat(0);
  expect(nearestRow(points, placing, Uint8Array.of(1, 1), [1.15, 0], 1)).toBe(2);
  expect(nearestRow(points, placing, Uint8Array.of(1, 0), [1.15, 0], 1)).toBe(1);
  expect(nearestRow(points, placing, Uint8Array.of(1, 1), [9, 9], 1)).toBe(-1);
});

test('cells of radio maps are coloured between the ends, and left out below the threshold or where nothing is known', () => {
  expect([-90, -65, -40, -200, 0].map((value) => stepOf(value, [-90, -40], null))).toEqual([0, 4, 7, 0, 7]);
  expect([NaN, -70, -60].map((value) => stepOf(value, [-90, -40], -67))).toEqual([-1, -1, 4]);
});
