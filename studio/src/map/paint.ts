// Draws plans, or a grid without them, walks, their 95 % band and scans on a canvas, from columns.
import { type Track, runs } from '../api/arrow';
import { type Affine, type Placing, at } from './affine';
import { type Colouring, lighter } from './colours';
import { gridStep } from './ground';
import { ribbons } from './ribbon';

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
  /** Tracks whose 95 % band is drawn. */
  bands: Track[];
  /** Outlines of walks on floors without a plan. */
  outlines: { floor: number; outline: number[][] }[];
  grid: boolean;
  stacked: boolean;
  dark: boolean;
}

export const BAND_COLOUR = '#56b4e9';
export const SCAN_COLOUR = '#9a6200';
export const GROUND_COLOUR = '#6e7781';
/** Points of the outline of a band are so many pixels apart. */
const SMOOTH = 6;
/** Points nearer than this to the last one drawn add nothing to see (pixels). */
const NEAR = 1.5;
const SOLID: number[] = [];

/** Paint a picture; `extent` is [left, low, right, high] of the map, `scale` pixels a metre. */
export function paint(context: CanvasRenderingContext2D, picture: Picture, extent: number[], scale: number): void {
  const toPixels = (placed: Affine): Affine => {
    const [a, b, c, d, e, f] = placed;
    return [a * scale, b * scale, (c - extent[0]) * scale, -d * scale, -e * scale, (extent[3] - f) * scale];
  };
  const placing: Placing = new Map([...picture.placing].map(([floor, placed]) => [floor, toPixels(placed)]));
  if (picture.grid) paintGrid(context, extent, scale, picture.dark);
  for (const { floor, outline } of picture.outlines) paintOutline(context, outline, placing.get(floor));
  for (const plan of picture.plans) paintPlan(context, plan, placing.get(plan.floor), picture.stacked);
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.globalAlpha = 1;
  context.lineJoin = 'round';
  for (const track of picture.bands) paintBand(context, track, picture, placing, scale);
  for (const track of picture.tracks) paintWalks(context, track, picture, placing);
  if (picture.scans) paintScans(context, picture.scans, picture, placing);
}

function paintGrid(context: CanvasRenderingContext2D, [left, low, right, high]: number[], scale: number, dark: boolean): void {
  const step = gridStep(devicePixelRatio / scale);
  context.beginPath();
  for (let x = Math.ceil(left / step) * step; x < right; x += step) lineTo((x - left) * scale, 0, (x - left) * scale, context.canvas.height);
  for (let y = Math.ceil(low / step) * step; y < high; y += step) lineTo(0, (high - y) * scale, context.canvas.width, (high - y) * scale);
  context.lineWidth = 1;
  context.strokeStyle = dark ? '#262c34' : '#e3e8ee';
  context.stroke();
  function lineTo(...[x0, y0, x1, y1]: number[]) {
    context.moveTo(Math.round(x0) + 0.5, Math.round(y0) + 0.5);
    context.lineTo(Math.round(x1) + 0.5, Math.round(y1) + 0.5);
  }
}

function paintOutline(context: CanvasRenderingContext2D, outline: number[][], placed: Affine | undefined): void {
  if (!placed) return;
  trace(context, outline, placed);
  context.lineWidth = 1.5;
  context.strokeStyle = GROUND_COLOUR;
  context.setLineDash([6, 5]);
  context.stroke();
  context.setLineDash([]);
}

/** A closed line through points of a floor, as the path to stroke or fill. */
function trace(context: CanvasRenderingContext2D, points: number[][], placed: Affine): void {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(...at(placed, x, y));
  context.closePath();
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
        const { colour: stroke, dash } = colouring.looks[index];
        context.strokeStyle = stroke;
        context.setLineDash(dash ?? SOLID);
        context.beginPath();
        context.moveTo(row === from ? x : lastX, row === from ? y : lastY);
        open = true;
      }
      context.lineTo(x, y);
    }
    [lastX, lastY, lastIn, colour] = [x, y, inside, index];
  }
  if (open) context.stroke();
  context.setLineDash(SOLID);
}

function paintBand(context: CanvasRenderingContext2D, track: Track, picture: Picture, placing: Placing, scale: number): void {
  context.globalAlpha = picture.chosen < 0 ? 0.2 : 0.3;
  context.fillStyle = BAND_COLOUR;
  for (const [from, to] of runs(track.path)) {
    const placed = placing.get(track.floor[from]);
    if (!placed || !picture.shown[track.session[from]]) continue;
    for (const outline of ribbons(track, from, to, SMOOTH / scale)) {
      trace(context, outline, placed);
      context.fill();
    }
  }
  context.globalAlpha = 1;
}

function paintScans(context: CanvasRenderingContext2D, scans: Track, picture: Picture, placing: Placing): void {
  context.globalAlpha = 0.8;
  context.fillStyle = picture.dark ? lighter(SCAN_COLOUR) : SCAN_COLOUR;
  for (let row = 0; row < scans.rows; row++) {
    const placed = placing.get(scans.floor[row]);
    const hidden = picture.chosen >= 0 ? scans.session[row] !== picture.chosen : !picture.shown[scans.session[row]];
    if (!placed || hidden) continue;
    const [x, y] = at(placed, scans.x[row], scans.y[row]);
    context.fillRect(x - 2.5, y - 2.5, 5, 5);
  }
}
