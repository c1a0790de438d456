// Where a point of a floor lies on the map: one floor as it is, or all floors stacked and seen from the side.
import type { Floor } from '../api/model';

/** X = a x + b y + c, Y = d x + e y + f. */
export type Affine = [a: number, b: number, c: number, d: number, e: number, f: number];
export type Placing = Map<number, Affine>;

export const at = ([a, b, c, d, e, f]: Affine, x: number, y: number): [number, number] => [a * x + b * y + c, d * x + e * y + f];

export function inverse([a, b, c, d, e, f]: Affine): Affine {
  const det = a * e - b * d;
  return [e / det, -b / det, (b * f - c * e) / det, -d / det, a / det, (c * d - a * f) / det];
}

export const flat = (floor: number): Placing => new Map([[floor, [1, 0, 0, 0, 1, 0]]]);

/** Floors above one another, turned about the vertical by `turn` (rad) and seen from `tilt` (rad) above the horizon. */
export function stacked(floors: Floor[], turn: number, tilt: number): Placing {
  const span = Math.max(...floors.map(({ extent_m: e }) => (e ? Math.max(e[1] - e[0], e[3] - e[2]) : 0)), 10);
  const [cos, sin, flatness] = [Math.cos(turn), Math.sin(turn), Math.sin(tilt)];
  return new Map(
    floors.map((floor, rank) => {
      const { rotation_rad: r, shift_m: [sx, sy] } = floor.site_T_bcs;
      const [p, q] = [Math.cos(r), Math.sin(r)];
      const lift = rank * 0.45 * span * Math.cos(tilt);
      return [
        floor.number,
        [
          cos * p - sin * q,
          -cos * q - sin * p,
          cos * sx - sin * sy,
          flatness * (sin * p + cos * q),
          flatness * (cos * p - sin * q),
          flatness * (sin * sx + cos * sy) + lift,
        ],
      ];
    }),
  );
}

/** Box [left, low, right, high] on the map of some boxes [left, right, low, high] of floors; null where there are none. */
export function boxOf(placing: Placing, boxes: { floor: number; extent: number[] }[]): number[] | null {
  const corners = boxes.flatMap(({ floor, extent: [left, right, low, high] }) => {
    const placed = placing.get(floor);
    return placed ? [at(placed, left, low), at(placed, right, low), at(placed, left, high), at(placed, right, high)] : [];
  });
  if (!corners.length) return null;
  const xs = corners.map(([x]) => x);
  const ys = corners.map(([, y]) => y);
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}
