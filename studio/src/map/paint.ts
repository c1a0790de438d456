// Draws plans, walks, their 95 % band and scans on a canvas, from columns.
import { type Track, runs } from '../api/arrow';
import { type Affine, type Placing, at } from './affine';
import type { Colouring } from './colours';

export interface Plan {
  floor: number;
  image: CanvasImageSource & { width: number; height: number };
  /** left, right, low, high; metres. */
  extent: number[];
}

export interface Picture {
  placing: Placing;
  plans: Plan[];
  tracks: Track[];
  scans: Track | null;
  colouring: Colouring;
  /** By index of the session: whether it is drawn. */
  shown: Uint8Array;
  /** Index of the session that stands out, -1: none. */
  chosen: number;
  band: boolean;
  stacked: boolean;
}

/** 95 % of a two-dimensional normal distribution lie within so many standard deviations: sqrt(chi2(0.95, 2)). */
const BAND = 2.4477;
/** Points nearer than this to the last one drawn add nothing to see (pixels). */
const NEAR = 1.5;

/** Paint a picture; `extent` is [left, low, right, high] of the map, `scale` pixels a metre. */
export function paint(context: CanvasRenderingContext2D, picture: Picture, extent: number[], scale: number): void {
  const toPixels = (placed: Affine): Affine => {
    const [a, b, c, d, e, f] = placed;
    return [a * scale, b * scale, (c - extent[0]) * scale, -d * scale, -e * scale, (extent[3] - f) * scale];
  };
  const placing: Placing = new Map([...picture.placing].map(([floor, placed]) => [floor, toPixels(placed)]));
  for (const plan of picture.plans) paintPlan(context, plan, placing.get(plan.floor), picture.stacked);
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.globalAlpha = 1;
  context.lineJoin = 'round';
  for (const track of picture.tracks) {
    if (picture.band) paintBand(context, track, picture, placing);
    paintWalks(context, track, picture, placing);
  }
  if (picture.scans) paintScans(context, picture.scans, picture, placing);
}

function paintPlan(context: CanvasRenderingContext2D, plan: Plan, placed: Affine | undefined, faint: boolean): void {
  if (!placed) return;
  const [left, right, low, high] = plan.extent;
  const { width, height } = plan.image;
  const [a, b, , d, e] = placed;
  const [x0, y0] = at(placed, left, high);
  const [sx, sy] = [(right - left) / width, (high - low) / height];
  context.setTransform(a * sx, d * sx, -b * sy, -e * sy, x0, y0);
  context.globalAlpha = faint ? 0.7 : 1;
  context.drawImage(plan.image, 0, 0);
}

function paintWalks(context: CanvasRenderingContext2D, track: Track, picture: Picture, placing: Placing): void {
  const { width, height } = context.canvas;
  const paths = runs(track.path.length ? track.path : track.session);
  const order = [...paths.filter(([from]) => track.session[from] !== picture.chosen), ...paths.filter(([from]) => track.session[from] === picture.chosen)];
  for (const [from, to] of order) {
    const placed = placing.get(track.floor[from]);
    if (!placed || !picture.shown[track.session[from]]) continue;
    const chosen = track.session[from] === picture.chosen;
    context.globalAlpha = picture.chosen < 0 || chosen ? 1 : 0.3;
    context.lineWidth = chosen ? 3 : 1.6;
    paintPath(context, track, from, to, placed, picture.colouring, width, height);
  }
}

function paintPath(
  context: CanvasRenderingContext2D,
  track: Track,
  from: number,
  to: number,
  [a, b, c, d, e, f]: Affine,
  colouring: Colouring,
  width: number,
  height: number,
): void {
  let [lastX, lastY, lastIn, colour, open] = [NaN, NaN, false, -1, false];
  for (let row = from; row < to; row++) {
    const x = a * track.x[row] + b * track.y[row] + c;
    const y = d * track.x[row] + e * track.y[row] + f;
    const index = colouring.index(track, row);
    if (index === colour && row < to - 1 && Math.abs(x - lastX) + Math.abs(y - lastY) < NEAR) continue;
    const inside = x > -20 && y > -20 && x < width + 20 && y < height + 20;
    if (index !== colour || !(inside || lastIn)) {
      if (open) context.stroke();
      open = false;
    }
    if (inside || lastIn) {
      if (!open) {
        context.strokeStyle = colouring.palette[index];
        context.beginPath();
        context.moveTo(row === from ? x : lastX, row === from ? y : lastY);
        open = true;
      }
      context.lineTo(x, y);
    }
    [lastX, lastY, lastIn, colour] = [x, y, inside, index];
  }
  if (open) context.stroke();
}

function paintBand(context: CanvasRenderingContext2D, track: Track, picture: Picture, placing: Placing): void {
  if (!track.cov_xx.length) return;
  context.globalAlpha = picture.chosen < 0 ? 0.12 : 0.25;
  context.fillStyle = '#56b4e9';
  let [lastX, lastY] = [NaN, NaN];
  for (let row = 0; row < track.rows; row++) {
    const placed = placing.get(track.floor[row]);
    if (!placed || !picture.shown[track.session[row]] || (picture.chosen >= 0 && track.session[row] !== picture.chosen)) continue;
    const [x, y] = at(placed, track.x[row], track.y[row]);
    if (Math.abs(x - lastX) + Math.abs(y - lastY) < 8) continue;
    const ellipse = ellipseOf(track.cov_xx[row], track.cov_xy[row], track.cov_yy[row]);
    if (!ellipse) continue;
    [lastX, lastY] = [x, y];
    const scale = Math.hypot(placed[0], placed[3]);
    context.beginPath();
    context.ellipse(x, y, BAND * ellipse.major * scale, BAND * ellipse.minor * scale, -ellipse.turn, 0, 2 * Math.PI);
    context.fill();
  }
}

/** Half axes (standard deviations, m) and direction (rad) of a covariance; null where it is not known. */
export function ellipseOf(xx: number, xy: number, yy: number): { major: number; minor: number; turn: number } | null {
  const [mean, half] = [(xx + yy) / 2, Math.hypot((xx - yy) / 2, xy)];
  if (!Number.isFinite(mean) || mean - half < 0) return null;
  return { major: Math.sqrt(mean + half), minor: Math.sqrt(mean - half), turn: 0.5 * Math.atan2(2 * xy, xx - yy) };
}

function paintScans(context: CanvasRenderingContext2D, scans: Track, picture: Picture, placing: Placing): void {
  context.globalAlpha = 0.8;
  context.fillStyle = '#9a6200';
  for (let row = 0; row < scans.rows; row++) {
    const placed = placing.get(scans.floor[row]);
    const hidden = picture.chosen >= 0 ? scans.session[row] !== picture.chosen : !picture.shown[scans.session[row]];
    if (!placed || hidden) continue;
    const [x, y] = at(placed, scans.x[row], scans.y[row]);
    context.fillRect(x - 2.5, y - 2.5, 5, 5);
  }
}
