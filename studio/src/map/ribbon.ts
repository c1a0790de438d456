// The 95 % band of a path: as wide as the position is uncertain across the walking direction.
import type { Track } from '../api/arrow';

/** 95 % of a two-dimensional normal distribution are within so many standard deviations: sqrt(chi2(0.95, 2)). */
export const BAND = 2.4477;

/** Half of the width of the 95 % ellipse of a covariance in a direction [x, y] of length 1; NaN if it is not known. */
export function halfWidth(xx: number, xy: number, yy: number, [x, y]: number[]): number {
  const possible = xx >= 0 && yy >= 0 && xx * yy - xy * xy >= -1e-12;
  return possible ? BAND * Math.sqrt(Math.max(0, x * x * xx + 2 * x * y * xy + y * y * yy)) : NaN;
}

/** Closed outlines [x, y] of the band of rows [from, to), from points at least `apart` metres apart; broken where the covariance is not known. */
export function ribbons(track: Track, from: number, to: number, apart: number): number[][][] {
  const found: number[][][] = [];
  let part: number[] = [];
  const end = () => {
    if (part.length > 1) found.push(outline(track, part));
    part = [];
  };
  for (let row = from; row < to; row++) {
    if (!Number.isFinite(track.cov_xx[row])) {
      end();
      continue;
    }
    const last = part.at(-1);
    const near = last !== undefined && Math.hypot(track.x[row] - track.x[last], track.y[row] - track.y[last]) < apart;
    if (!near) part.push(row);
  }
  end();
  return found;
}

/** So many points before and after one smooth its direction and width. */
const AROUND = 3;

function outline({ x, y, cov_xx, cov_xy, cov_yy }: Track, rows: number[]): number[][] {
  const sides = rows.map((_, place) => {
    const around = rows.slice(Math.max(0, place - AROUND), place + AROUND + 1);
    const [first, last] = [around[0], around[around.length - 1]];
    const length = Math.hypot(x[last] - x[first], y[last] - y[first]) || 1; // there and back: it has no direction, and no width
    const across = [(y[first] - y[last]) / length, (x[last] - x[first]) / length];
    const widths = around.map((row) => halfWidth(cov_xx[row], cov_xy[row], cov_yy[row], across)).filter(Number.isFinite);
    const half = widths.reduce((sum, width) => sum + width, 0) / (widths.length || 1);
    return across.map((part) => half * part);
  });
  const edge = (side: 1 | -1) => rows.map((row, place) => [x[row] + side * sides[place][0], y[row] + side * sides[place][1]]);
  return [...edge(1), ...edge(-1).reverse()];
}
