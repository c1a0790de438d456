// The walk and moment under a place of the map.
import type { Track } from '../api/arrow';
import { type Placing, at } from './affine';

/** Nearest row within `reach` (m on the map) of a place of the map; -1: none. */
export function nearestRow(track: Track, placing: Placing, shown: Uint8Array, place: number[], reach: number): number {
  let [best, nearest] = [-1, reach];
  for (let row = 0; row < track.rows; row++) {
    if (!shown[track.session[row]]) continue;
    const placed = placing.get(track.floor[row]);
    if (!placed) continue;
    const [x, y] = at(placed, track.x[row], track.y[row]);
    const distance = Math.hypot(x - place[0], y - place[1]);
    if (distance < nearest) [best, nearest] = [row, distance];
  }
  return best;
}
