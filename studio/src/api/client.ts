// Requests to the server. What it refuses is a Refusal with its sentence.
import type { AddedFloor, Change, Collecting, Comparison, CorrectionTable, Corrections, Covered, Diagnosis, DroppedFile, Feature, FloorRequest, Job, LayerInfo, PlanChange, PlanLook, PlanWish, Planned, Preview, Problem, Radio, RegisterWish, Registered, SessionDetail, Session, Sheets, SheetsWish, Survey, Walls, WallsWish, Written } from './model';
import { type Series, type Track, readCells, readSeries, readTrack } from './arrow';

export class Refusal extends Error {
  constructor(readonly problem: Problem) {
    super(problem.message);
  }
}

async function request(method: string, path: string, body?: unknown, headers: Record<string, string> = {}): Promise<Response> {
  const answer = await fetch(path, {
    method,
    credentials: 'same-origin',
    headers: body === undefined ? headers : { ...headers, 'Content-Type': body instanceof Blob ? 'application/octet-stream' : 'application/json' },
    body: body === undefined || body instanceof Blob ? body : JSON.stringify(body),
  });
  if (answer.ok) return answer;
  const problem: Problem = await answer
    .json()
    .catch(() => ({ code: 'unexpected', message: `${answer.status} ${answer.statusText}`, corrections: null }));
  throw new Refusal(problem);
}

async function json<T>(method: string, path: string, body?: unknown, headers?: Record<string, string>): Promise<T> {
  return (await request(method, path, body, headers)).json() as Promise<T>;
}

async function track(path: string): Promise<Track> {
  const answer = await request('GET', path);
  return readTrack(await answer.arrayBuffer(), Number(answer.headers.get('Studio-Stride') ?? 1));
}

const name = encodeURIComponent;

/** Exchange the token of the address for a cookie, and take it out of the address. */
export async function enter(): Promise<void> {
  const token = location.hash.slice(1);
  if (!token) return;
  history.replaceState(null, '', location.pathname);
  await request('POST', '/api/enter', { token });
}

export const survey = () => json<Survey>('GET', '/api/survey');
export const sessions = async () => (await json<{ sessions: Session[] }>('GET', '/api/sessions')).sessions;
export const session = (id: string) => json<SessionDetail>('GET', `/api/sessions/${name(id)}`);
export const overview = (output: string) => track(`/api/tracks?output=${name(output)}`);

/** Frames in a box [left, low, right, high] of a floor, metres; every one, or `points` at most. */
export const frames = (output: string, floor: number, [left, low, right, high]: number[], points: number) =>
  track(`/api/tracks/window?output=${name(output)}&floor=${floor}&left=${left}&right=${right}&low=${low}&high=${high}&points=${points}`);
export const walk = (id: string, output: string) => track(`/api/sessions/${name(id)}/track?output=${name(output)}`);
export const scans = (output: string) => track(`/api/scans?output=${name(output)}`);

export async function series(id: string, output: string): Promise<Series[]> {
  return readSeries(await (await request('GET', `/api/sessions/${name(id)}/series?output=${name(output)}&points=2000`)).arrayBuffer());
}

export const corrections = () => json<Corrections>('GET', '/api/corrections');
export const correctionTables = async () => (await json<{ tables: CorrectionTable[] }>('GET', '/api/corrections/tables')).tables;
export const preview = (changes: Change[], text: string | null = null) =>
  json<Preview>('POST', '/api/corrections/preview', { text, changes });
export const save = (text: string, version: string) =>
  json<Corrections>('PUT', '/api/corrections', { text }, { 'If-Match': `"${version}"` });

export const process = (ids: string[] | null = null) => json<Job>('POST', '/api/jobs', { kind: 'process', sessions: ids });
export const diagnose = () => json<Job>('POST', '/api/jobs', { kind: 'diagnose' });
export const cancel = (id: number) => json<Job>('DELETE', `/api/jobs/${id}`);
export const diagnosis = () => json<Diagnosis>('GET', '/api/diagnosis');
export const invite = async () => (await json<{ url: string }>('POST', '/api/invitations', {})).url;
export const compare = (a: string, b: string) => json<Comparison>('GET', `/api/compare?a=${name(a)}&b=${name(b)}`);
export const makeRadio = () => json<Job>('POST', '/api/jobs', { kind: 'radio' });
export const radio = () => json<Radio>('GET', '/api/radio');
/** Cells of a layer, row by row from the lower edge. */
export const radioMap = async (floor: number, technology: string, layer: string, bssid: string) =>
  readCells(await (await request('GET', `/api/radio/map?floor=${floor}&technology=${name(technology)}&layer=${layer}&bssid=${name(bssid)}`)).arrayBuffer());
export const collecting = () => json<Collecting>('GET', '/api/collecting');
export const collect = () => json<Collecting>('POST', '/api/collecting', {});
export const endCollecting = () => json<Collecting>('DELETE', '/api/collecting');
export const covered = async () => (await json<{ floors: Covered[] }>('GET', '/api/covered')).floors;
export const layers = async () => (await json<{ layers: LayerInfo[] }>('GET', '/api/layers')).layers;
export const features = async (layer: string, floor: number) =>
  (await json<{ features: Feature[] }>('GET', `/api/layers/${name(layer)}?floor=${floor}`)).features;

/** Bring a file, which the server keeps under a number while it runs. */
export const drop = (file: File) => json<DroppedFile>('POST', `/api/prepare/files?name=${name(file.name)}`, file);
export const look = (file: number, page: number) => json<PlanLook>('GET', `/api/prepare/files/${file}/look?page=${page}`);
export const pictureOf = (file: number, page: number) => `/api/prepare/files/${file}/picture?page=${page}`;
export const addFloor = (request: FloorRequest) => json<AddedFloor>('POST', '/api/prepare/floors', request);
export const plan = (wish: PlanWish) => json<Planned>('POST', '/api/prepare/plans', wish);
export const changePlan = (change: PlanChange) => json<Planned>('POST', '/api/prepare/plans/change', change);
export const writePlan = (change: PlanChange) => json<Written>('POST', '/api/prepare/plans/write', change);
export const makeSheets = (wish: SheetsWish) => json<Sheets>('POST', '/api/prepare/sheets', wish);
export const register = (wish: RegisterWish) => json<Registered>('POST', '/api/prepare/positions', wish);
export const walls = (wish: WallsWish) => json<Walls>('POST', '/api/prepare/walls', wish);
