// Requests to a running studio. What it refuses is a Refusal with its sentence.
import type { Problem } from './model';
import { type Track, readCells, readSeries, readTrack } from './arrow';
import { type Source, reached } from './source';

export class Refusal extends Error {
  constructor(readonly problem: Problem) {
    super(problem.message);
  }
}

export async function request(method: string, path: string, body?: unknown, headers: Record<string, string> = {}): Promise<Response> {
  const answer = await reached(
    fetch(path, {
      method,
      credentials: 'same-origin',
      headers: body === undefined ? headers : { ...headers, 'Content-Type': body instanceof Blob ? 'application/octet-stream' : 'application/json' },
      body: body === undefined || body instanceof Blob ? body : JSON.stringify(body),
    }),
  );
  if (answer.ok) return answer;
  const problem: Problem = await answer
    .json()
    .catch(() => ({ code: 'unexpected', message: `${answer.status} ${answer.statusText}`, conflicts: [], corrections: null }));
  throw new Refusal(problem);
}

export const answered = async <T>(answer: Promise<Response>): Promise<T> => reached((await answer).json() as Promise<T>);
const bytes = async (answer: Promise<Response>): Promise<ArrayBuffer> => reached((await answer).arrayBuffer());

async function get(path: string, query: Record<string, string | number> = {}): Promise<Response> {
  const text = new URLSearchParams(Object.entries(query).map(([name, value]) => [name, String(value)])).toString();
  return request('GET', `/api/${path}${text && `?${text}`}`);
}

async function track(path: string, query: Record<string, string | number>): Promise<Track> {
  const answer = get(path, query);
  return readTrack(await bytes(answer), Number((await answer).headers.get('Studio-Stride') ?? 1));
}

const name = encodeURIComponent;

export const server: Source = {
  json: (path, query) => answered(get(path, query)),
  overview: (output) => track('tracks', { output }),
  frames: (output, floor, [left, low, right, high], points) => track('tracks/window', { output, floor, left, right, low, high, points }),
  walk: (id, output) => track(`sessions/${name(id)}/track`, { output }),
  scans: (output) => track('scans', { output }),
  series: async (id, output) => readSeries(await bytes(get(`sessions/${name(id)}/series`, { output, points: 2000 }))),
  radioMap: async (floor, technology, layer, bssid) => readCells(await bytes(get('radio/map', { floor, technology, layer, bssid }))),
};
