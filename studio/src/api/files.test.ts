import { describe, expect, it } from 'vitest';
import { brokenPaths, spans } from './files';

const group = (rows: number, x: [number, number] | null) => ({
  num_rows: BigInt(rows),
  columns: [{ meta_data: { path_in_schema: ['x'], statistics: x && { min_value: x[0], max_value: x[1] } } }],
});
const found = (groups: unknown[], low: number, high: number) =>
  spans({ metadata: { row_groups: groups } } as unknown as Parameters<typeof spans>[0], (of) => {
    const x = of('x');
    return x !== null && x.min <= high && x.max >= low;
  });

describe('which rows of a table are read', () => {
  it('reads groups that may hold a place, those beside each other at once', () => {
    const groups = [group(10, [0, 1]), group(10, [1, 2]), group(10, null), group(5, [0, 9])];
    expect(found(groups, 0.5, 1.5)).toEqual([[0, 20], [30, 35]]);
    expect(found(groups, 10, 11)).toEqual([]);
  });
});

describe('paths through the rows of a part of a floor', () => {
  it('break where the walk, its path or a frame between does', () => {
    const of = { session: [0, 0, 0, 0, 1], path: [0, 0, 0, 1, 1], frame: [0, 1, 3, 4, 5] };
    const columns = { rows: 5, of: Object.fromEntries(Object.entries(of).map(([name, values]) => [name, Float64Array.from(values)])) };
    expect([...brokenPaths(columns, Uint32Array.from([0, 1, 2, 3, 4]))]).toEqual([0, 0, 1, 2, 3]);
  });
});
