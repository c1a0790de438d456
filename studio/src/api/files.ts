// Files of an export: answers as JSON, tables as Parquet of which ranges of bytes are read.
import { type AsyncBuffer, type FileMetaData, asyncBufferFromUrl, parquetMetadataAsync, parquetRead } from 'hyparquet';
import { type Series, seriesOf, trackOf } from './arrow';
import type { Radio, Session } from './model';
import { type Source, reached } from './source';

type Rows = [from: number, to: number];
type Statistic = { min: number; max: number } | null;
interface Table {
  file: AsyncBuffer;
  metadata: FileMetaData;
}

/** Windows of more frames than this many times those wanted are not read: the overview has to do. */
const MOST_READ = 3;
const OF_ALL = ['strongest', 'number'];

/** The files below a folder; `whole` is called where a server gives whole files when asked for a part. */
export function filesIn(folder: string, whole: () => void): Source {
  const tables = new Map<string, Promise<Table>>();
  const lists = new Map<string, Promise<unknown>>();

  async function watched(address: RequestInfo | URL, init?: RequestInit): Promise<Response> {
    const answer = await reached(fetch(address, init));
    if (answer.status === 200 && new Headers(init?.headers).has('Range')) whole();
    return answer;
  }

  function table(path: string): Promise<Table> {
    const found = tables.get(path) ?? opened(`${folder}${path}.parquet`);
    tables.set(path, found);
    found.catch(() => tables.delete(path));
    return found;
  }

  async function opened(url: string): Promise<Table> {
    const file = await asyncBufferFromUrl({ url, fetch: watched });
    return { file, metadata: await parquetMetadataAsync(file, { initialFetchSize: 1 << 14 }) };
  }

  async function json<T>(path: string, query: Record<string, string | number> = {}): Promise<T> {
    const address = `${folder}${[path, ...Object.values(query).map((value) => encodeURIComponent(value))].join('/')}.json`;
    const answer = await reached(fetch(address));
    if (!answer.ok) throw new Error(`${address}: ${answer.status} ${answer.statusText}`);
    return reached(answer.json() as Promise<T>);
  }

  /** Of a walk: its number in the tables. */
  async function numberOf(id: string): Promise<number> {
    const found = lists.get('sessions') ?? json<{ sessions: Session[] }>('sessions');
    lists.set('sessions', found);
    found.catch(() => lists.delete('sessions'));
    const { sessions } = (await found) as { sessions: Session[] };
    return sessions.findIndex((session) => session.id === id);
  }

  /** The rows of a walk, of a table that is sorted by walks. */
  async function rowsOf(found: Table, id: string): Promise<{ columns: Columns; keep: Uint32Array }> {
    const walk = await numberOf(id);
    const columns = await read(found, spans(found, (of) => within(of('session'), walk, walk)));
    return { columns, keep: rowsWhere(columns.rows, (row) => columns.of.session[row] === walk) };
  }

  return {
    json,
    async overview(output) {
      const found = await table(`tracks/${output}/overview`);
      const stride = found.metadata.key_value_metadata?.find(({ key }) => key === 'stride')?.value;
      return trackOf(plain(await read(found)), Number(stride ?? 1));
    },
    async frames(output, floor, [left, low, right, high], points) {
      const found = await table(`tracks/${output}/frames`);
      const there = spans(found, (of) => within(of('floor'), floor, floor) && within(of('x'), left, right) && within(of('y'), low, high));
      if (there.reduce((sum, [from, to]) => sum + to - from, 0) > MOST_READ * points) return null;
      const columns = await read(found, there);
      const { x, y, floor: floors } = columns.of;
      const inside = rowsWhere(columns.rows, (row) => floors[row] === floor && x[row] >= left && x[row] <= right && y[row] >= low && y[row] <= high);
      const stride = Math.max(1, Math.ceil(inside.length / points));
      const paths = brokenPaths(columns, inside);
      const kept = rowsWhere(inside.length, (place) => place % stride === 0);
      const part = taken(columns, kept.map((place) => inside[place]));
      return trackOf(part.set('path', kept.map((place) => paths[place])), stride);
    },
    async walk(id, output) {
      const { columns, keep } = await rowsOf(await table(`tracks/${output}/frames`), id);
      return trackOf(taken(columns, keep), 1);
    },
    async scans(output) {
      return trackOf(plain(await read(await table(`tracks/${output}/scans`))), 1);
    },
    async series(id, output): Promise<Series[]> {
      const { columns, keep } = await rowsOf(await table(`tracks/${output}/series`), id);
      return seriesOf(taken(columns, keep));
    },
    async radioMap(floor, technology, layer, bssid) {
      const all = OF_ALL.includes(layer);
      const found = await table(`radio/${floor}-${technology}${all ? '-all' : ''}`);
      if (all) return Float32Array.from((await read(found, undefined, [layer])).of[layer]);
      const { floors } = (await json<Radio>('radio')) ?? {};
      const maps = floors.find((each) => each.floor === floor && each.technology === technology)!;
      const cells = maps.rows * maps.columns;
      const place = maps.access_points.findIndex((point) => point.bssid === bssid);
      return Float32Array.from((await read(found, [[place * cells, (place + 1) * cells]], [layer])).of[layer]);
    },
  };
}

interface Columns {
  rows: number;
  of: Record<string, Float64Array>;
}

/** Whole groups of rows, one after the other; all, unless told which. */
async function read({ file, metadata }: Table, parts?: Rows[], names = namesOf(metadata)): Promise<Columns> {
  const wanted: Rows[] = parts ?? [[0, Number(metadata.num_rows)]];
  const rows = wanted.reduce((sum, [from, to]) => sum + to - from, 0);
  const of = Object.fromEntries(names.map((name) => [name, new Float64Array(rows)]));
  let first = 0;
  for (const [rowStart, rowEnd] of wanted) {
    const offset = first - rowStart;
    if (rowEnd > rowStart)
      await parquetRead({
        file,
        metadata,
        columns: names,
        rowStart,
        rowEnd,
        onChunk: ({ columnName, columnData, rowStart: at }) => of[columnName].set(columnData as ArrayLike<number>, at + offset),
      });
    first += rowEnd - rowStart;
  }
  return { rows, of };
}

const namesOf = (metadata: FileMetaData): string[] => metadata.schema.slice(1).map(({ name }) => name);

/** Rows of the groups that fit by their statistics, those beside each other in one. */
export function spans({ metadata }: Pick<Table, 'metadata'>, fits: (of: (name: string) => Statistic) => boolean): Rows[] {
  const found: Rows[] = [];
  let from = 0;
  for (const group of metadata.row_groups) {
    const to = from + Number(group.num_rows);
    const statistic = (name: string): Statistic => {
      const { min_value: min, max_value: max } = group.columns.find(({ meta_data: of }) => of?.path_in_schema[0] === name)?.meta_data?.statistics ?? {};
      return min === undefined || max === undefined ? null : { min: Number(min), max: Number(max) };
    };
    if (fits(statistic)) {
      const last = found.at(-1);
      if (last && last[1] === from) last[1] = to;
      else found.push([from, to]);
    }
    from = to;
  }
  return found;
}

/** Whether a group may hold values of an interval; one without any has no statistic. */
const within = (statistic: Statistic, low: number, high: number): boolean => statistic !== null && statistic.min <= high && statistic.max >= low;

function rowsWhere(rows: number, wanted: (row: number) => boolean): Uint32Array {
  const found = new Uint32Array(rows);
  let count = 0;
  for (let row = 0; row < rows; row++) if (wanted(row)) found[count++] = row;
  return found.slice(0, count);
}

const plain = ({ of }: Columns): Map<string, ArrayLike<number>> => new Map(Object.entries(of));

const taken = ({ of }: Columns, rows: Uint32Array): Map<string, ArrayLike<number>> =>
  new Map(Object.entries(of).map(([name, values]) => [name, Float64Array.from(rows, (row) => values[row])]));

/** Numbers of unbroken paths through some rows: another begins where the walk, its path or a frame between breaks it. */
export function brokenPaths({ of: { session, path, frame } }: Columns, rows: Uint32Array): Uint32Array {
  let number = 0;
  return rows.map((row, place) => {
    const before = rows[place - 1];
    if (place && (session[row] !== session[before] || path[row] !== path[before] || frame[row] !== frame[before] + 1)) number++;
    return number;
  });
}

