// How long the frames took that were drawn while the map moved, and how many points of walks were in view.
import type Map from 'ol/Map';

const KEPT = 5000;

interface Frame {
  ms: number;
  points: number;
  /** Whether every frame of the labels was drawn. */
  whole: boolean;
}

export class FrameTrace {
  readonly frames: Frame[] = [];
  private moving = false;

  constructor(
    map: Map,
    private readonly inView: () => Pick<Frame, 'points' | 'whole'>,
  ) {
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
      this.frames.push({ ms: now - last, ...this.inView() });
      if (this.frames.length > KEPT) this.frames.shift();
      last = now;
      if (this.moving) requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }
}
