// Where labels of one output are away from those of another.
import type { Track } from '../api/arrow';

export interface Move {
  session: number;
  floor: number;
  from: [number, number];
  to: [number, number];
  metres: number;
}

/** Smaller differences are not shown (m). */
const LEAST_M = 0.05;

/** The largest moves between the same moments of two tracks on some floors, largest first, begun at least `apart` metres from each other. */
export function largestMoves(one: Track, other: Track, floors: number[], most: number, apart: number): Move[] {
  const moves = movesOf(one, other).filter(({ floor }) => floors.includes(floor)).sort((a, b) => b.metres - a.metres);
  const kept: Move[] = [];
  for (const move of moves) {
    if (kept.length === most) break;
    const free = kept.every(({ floor, from: [x, y] }) => floor !== move.floor || Math.hypot(x - move.from[0], y - move.from[1]) >= apart);
    if (free) kept.push(move);
  }
  return kept;
}

/** Both tracks are in order of sessions and frames; the other may be thinned to other frames, and is interpolated. */
function movesOf(one: Track, other: Track): Move[] {
  const moves: Move[] = [];
  let after = 0;
  for (let row = 0; row < one.rows; row++) {
    const [session, floor, frame] = [one.session[row], one.floor[row], one.frame[row]];
    while (after < other.rows && (other.session[after] < session || (other.session[after] === session && other.frame[after] < frame))) after++;
    if (after === other.rows) break;
    const before = other.frame[after] === frame ? after : after - 1;
    const joined = before >= 0 && other.session[before] === session && other.session[after] === session && other.path[before] === other.path[after];
    if (!joined || other.floor[after] !== floor) continue;
    const share = before === after ? 0 : (frame - other.frame[before]) / (other.frame[after] - other.frame[before]);
    const between = (values: Float32Array) => values[before] + share * (values[after] - values[before]);
    const [from, to]: [number, number][] = [[one.x[row], one.y[row]], [between(other.x), between(other.y)]];
    const metres = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (metres >= LEAST_M) moves.push({ session, floor, from, to, metres });
  }
  return moves;
}
