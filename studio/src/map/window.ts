// Which part of a floor is worth fetching with every frame.
import type { Track } from '../api/arrow';
import type { Session } from '../api/model';

/** So many frames are fetched for a window at most. */
const MOST = 150_000;

/** The box (metres, a little wider than the view) to fetch in full; null: the overview does. */
export function windowOf(overview: Track, sessions: Session[], floor: number, extent: number[]): number[] | null {
  const all = sessions.reduce((sum, { frames }) => sum + Object.values(frames).reduce((a, b) => a + b, 0), 0);
  const thinned = all / Math.max(1, overview.rows);
  if (thinned < 1.5) return null;
  const margin = 0.2 * (extent[2] - extent[0]);
  const box = [extent[0] - margin, extent[1] - margin, extent[2] + margin, extent[3] + margin];
  let inside = 0;
  for (let row = 0; row < overview.rows; row++) {
    if (overview.floor[row] !== floor) continue;
    const [x, y] = [overview.x[row], overview.y[row]];
    if (x > box[0] && y > box[1] && x < box[2] && y < box[3]) inside++;
  }
  return inside && inside * thinned < MOST ? box : null;
}
