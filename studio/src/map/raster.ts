// Cells of a radio map as a picture to lay over a floor's plan.
import { ORDERED } from './colours';
import type { Plan } from './paint';

export interface Raster {
  floor: number;
  /** left, right, low, high; metres. */
  extent: number[];
  rows: number;
  columns: number;
  /** Row by row from the lower edge; NaN: not known. */
  cells: Float32Array;
}

const ALPHA = 200;

/** Number of the colour of a value between two ends; -1: not drawn, as not known or below the threshold. */
export function stepOf(value: number, [low, high]: [number, number], least: number | null): number {
  if (Number.isNaN(value) || (least !== null && value < least)) return -1;
  const share = (value - low) / (high - low || 1);
  return Math.max(0, Math.min(ORDERED.length - 1, Math.floor(share * ORDERED.length)));
}

/** The picture of a raster; cells below `least` are left out. */
export function pictureOf({ floor, extent, rows, columns, cells }: Raster, ends: [number, number], least: number | null): Plan {
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [columns, rows];
  const context = canvas.getContext('2d')!;
  const image = context.createImageData(columns, rows);
  const colours = ORDERED.map((colour) => [1, 3, 5].map((place) => parseInt(colour.slice(place, place + 2), 16)));
  cells.forEach((value, cell) => {
    const step = stepOf(value, ends, least);
    if (step < 0) return;
    const [row, column] = [rows - 1 - Math.floor(cell / columns), cell % columns];
    image.data.set([...colours[step], ALPHA], 4 * (row * columns + column));
  });
  context.putImageData(image, 0, 0);
  return { floor, image: canvas, extent };
}
