// How long the frames took that were drawn while the map moved.
import type Map from 'ol/Map';

const KEPT = 5000;

export class FrameTrace {
  readonly intervals: number[] = [];
  private moving = false;

  constructor(map: Map) {
    map.on('movestart', () => this.begin());
    // A listener that returns false would keep the event from those after it.
    map.on('moveend', () => {
      this.moving = false;
    });
  }

  private begin(): void {
    if (this.moving) return;
    this.moving = true;
    let last = performance.now();
    const tick = () => {
      const now = performance.now();
      this.intervals.push(now - last);
      if (this.intervals.length > KEPT) this.intervals.shift();
      last = now;
      if (this.moving) requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  /** Number of frames and the interval (ms) that 95 % of them kept; null before the map was moved. */
  summary(): { frames: number; within_ms: number } | null {
    if (!this.intervals.length) return null;
    const sorted = [...this.intervals].sort((a, b) => a - b);
    return { frames: sorted.length, within_ms: sorted[Math.floor(0.95 * (sorted.length - 1))] };
  }
}
