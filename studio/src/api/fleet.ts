// The list of a fleet's surveys: its first rows at once, all of them when somebody searches.
import type { FleetView } from './model';
import { reached } from './source';

export type Row = FleetView['rows'][number];

async function fetched(address: string): Promise<Response> {
  const answer = await reached(fetch(address));
  if (!answer.ok) throw new Error(`${address}: ${answer.status} ${answer.statusText}`);
  return answer;
}

export const firstRows = async (folder: string) => (await fetched(`${folder}first.json`)).json() as Promise<FleetView>;

export async function allRows(folder: string): Promise<Row[]> {
  const [{ parquetReadObjects }, file] = await Promise.all([
    import('hyparquet'),
    fetched(`${folder}catalogue.parquet`).then((answer) => answer.arrayBuffer()),
  ]);
  const rows = await parquetReadObjects({ file });
  return rows.map((row) => Object.fromEntries(Object.entries(row).map(([name, value]) => [name, typeof value === 'bigint' ? Number(value) : value])) as Row);
}
