// Images of floor plans, turned to light on dark where the page is dark.
import { planAddress } from '../api/client';
import type { Floor } from '../api/model';
import type { Plan } from './paint';

const loaded = new Map<string, Promise<HTMLCanvasElement>>();

export function planOf(floor: Floor, dark: boolean): Promise<Plan> | null {
  const { plan, extent_m: extent, number } = floor;
  if (!plan || !extent) return null;
  const key = `${plan} ${dark}`;
  if (!loaded.has(key)) loaded.set(key, load(plan, dark));
  return loaded.get(key)!.then((image) => ({ floor: number, image, extent }));
}

export async function loadPicture(address: string): Promise<HTMLImageElement> {
  const image = new Image();
  image.src = address;
  await image.decode();
  return image;
}

async function load(address: string, dark: boolean): Promise<HTMLCanvasElement> {
  const image = await loadPicture(planAddress(address));
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
  const context = canvas.getContext('2d')!;
  context.drawImage(image, 0, 0);
  if (dark) {
    context.globalCompositeOperation = 'difference';
    context.fillStyle = '#eee';
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.globalCompositeOperation = 'destination-in';
    context.drawImage(image, 0, 0);
  }
  return canvas;
}
