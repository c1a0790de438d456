// How many points were drawn where, coarsely, so that those in view can be counted in every frame.
const CELL = 32;

export class Density {
  private readonly columns: number;
  private readonly rows: number;
  private readonly counts: Uint32Array;

  constructor(width: number, height: number) {
    this.columns = Math.ceil(width / CELL);
    this.rows = Math.ceil(height / CELL);
    this.counts = new Uint32Array(this.columns * this.rows);
  }

  add(x: number, y: number): void {
    const [column, row] = [Math.floor(x / CELL), Math.floor(y / CELL)];
    if (column >= 0 && column < this.columns && row >= 0 && row < this.rows) this.counts[row * this.columns + column]++;
  }

  /** Points in all cells that lie whole in a box of pixels. */
  within(left: number, top: number, right: number, bottom: number): number {
    const [first, last] = [Math.max(0, Math.ceil(left / CELL)), Math.min(this.columns, Math.floor(right / CELL))];
    let sum = 0;
    for (let row = Math.max(0, Math.ceil(top / CELL)); row < Math.min(this.rows, Math.floor(bottom / CELL)); row++)
      for (let column = first; column < last; column++) sum += this.counts[row * this.columns + column];
    return sum;
  }
}
