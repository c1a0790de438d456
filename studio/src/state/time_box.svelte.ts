// How the panel of time is shown, which the browser keeps.
const KEY = 'time panel';

interface Kept {
  isOpen: boolean;
  hasCharts: boolean;
  /** Pixels; 0: as high as its content, within limits. */
  height: number;
}

function kept(): Partial<Kept> {
  try {
    return JSON.parse(localStorage.getItem(KEY) ?? '{}') as Partial<Kept>;
  } catch {
    return {};
  }
}

class TimeBox {
  /** Smallest height (pixels). */
  readonly least = 96;
  private state = $state.raw<Kept>({ isOpen: innerHeight > 560, hasCharts: innerWidth >= 800, height: 0, ...kept() });

  get isOpen() {
    return this.state.isOpen;
  }
  set isOpen(isOpen: boolean) {
    this.keep({ isOpen });
  }
  get hasCharts() {
    return this.state.hasCharts;
  }
  set hasCharts(hasCharts: boolean) {
    this.keep({ hasCharts });
  }
  get height() {
    return this.state.height;
  }

  resize(height: number): void {
    this.keep({ height: Math.round(Math.max(this.least, Math.min(0.75 * innerHeight, height))) });
  }

  private keep(change: Partial<Kept>): void {
    this.state = { ...this.state, ...change };
    localStorage.setItem(KEY, JSON.stringify(this.state));
  }
}

export const timeBox = new TimeBox();
