import { describe, expect, test } from 'vitest';
import type { Track } from '../api/arrow';
import type { Floor, Session, StatusStyle } from '../api/model';
import { at, boxOf, flat, inverse, stacked } from './affine';
import { colouring } from './colours';
import { ellipseOf } from './paint';
import { nearestRow } from './pick';
import { stepOf } from './raster';

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

  test('status takes the colour of the command line', () => {
    const colours = colouring('status', [], statuses, 1);
    expect(colours.palette[colours.index(track([0], [0]), 0)]).toBe('#56b4e9');
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

test('the ellipse of a covariance has its axes and direction; an impossible one has none', () => {
  const ellipse = ellipseOf(2.5, 1.5, 2.5)!;
  expect([ellipse.major, ellipse.minor, ellipse.turn]).toEqual([2, 1, Math.PI / 4].map((value) => expect.closeTo(value, 9)));
  expect(ellipseOf(1, 5, 1)).toBeNull();
  expect(ellipseOf(NaN, 0, 1)).toBeNull();
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
