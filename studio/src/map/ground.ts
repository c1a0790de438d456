// What is drawn where a floor has no plan: an outline of its walks and a metric grid.
import type { Track } from '../api/arrow';

/** Convex outline of points, counter-clockwise (Andrew's monotone chain); of fewer than three points themselves. */
export function hullOf(points: number[][]): number[][] {
  const sorted = [...points].sort(([ax, ay], [bx, by]) => ax - bx || ay - by);
  if (sorted.length < 3) return sorted;
  const half = (along: number[][]): number[][] => {
    const chain: number[][] = [];
    for (const point of along) {
      while (chain.length > 1 && !turnsLeft(chain[chain.length - 2], chain[chain.length - 1], point)) chain.pop();
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

const turnsLeft = ([ax, ay]: number[], [bx, by]: number[], [cx, cy]: number[]): boolean => (bx - ax) * (cy - ay) > (by - ay) * (cx - ax);

/** Outline of the walks on a floor. */
export function outlineOf(track: Track, floor: number): number[][] {
  const points: number[][] = [];
  for (let row = 0; row < track.rows; row++) if (track.floor[row] === floor) points.push([track.x[row], track.y[row]]);
  return hullOf(points);
}

/** The smallest of 1, 2, 5, 10, 20 ... (and parts of 1) that is not less than `least`. */
export function roundStep(least: number): number {
  const ten = 10 ** Math.floor(Math.log10(least));
  return ten * ([1, 2, 5].find((step) => step * ten >= least * (1 - 1e-9)) ?? 10);
}

/** Lines of the grid are at least so many pixels apart. */
const APART_PX = 45;

/** Distance between the lines of the grid (m) at a resolution (m per pixel). */
export const gridStep = (resolution: number): number => roundStep(APART_PX * resolution);
