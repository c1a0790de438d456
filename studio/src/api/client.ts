// What the page asks for and tells: of a running studio, or of the files of an export, which only shows.
import type { AddedFloor, Change, ChangedFloor, Collecting, Comparison, CorrectionTable, Corrections, Covered, Diagnosis, DroppedFile, Feature, FloorChange, FloorRequest, Job, LayerInfo, PlanChange, PlanLook, PlanWish, Planned, Preview, Radio, RegisterWish, Registered, Rooms, RoomsWish, SessionDetail, Session, Shared, Sheets, SheetsWish, Survey, Taps, Undone, Walls, WallsWish, Written } from './model';
import { answered, request, server } from './server';
import { type Source, folder } from './source';

export { Refusal } from './server';
export { Unreachable, isReachable } from './source';

/** Nothing can be changed or asked for that was not written ahead. */
export const readOnly = folder !== null;

/** Told once a server gives whole files where a part is asked for. */
export const reading = { whole: () => {} };

const source: Promise<Source> = folder === null ? Promise.resolve(server) : import('./files').then(({ filesIn }) => filesIn(folder!, () => reading.whole()));

const get = async <T>(path: string, query?: Record<string, string | number>): Promise<T> => (await source).json<T>(path, query);
const json = <T>(method: string, path: string, body?: unknown, headers?: Record<string, string>): Promise<T> =>
  answered(request(method, path, body, headers));

const name = encodeURIComponent;

/** The token in the address; empty: there is none, as in a link to a view. */
export const tokenHere = (): string => (readOnly || location.hash.includes('=') ? '' : location.hash.slice(1));

/** Exchange the token of the address for a cookie, and take it out of the address. */
export async function enter(): Promise<void> {
  const token = tokenHere();
  if (!token) return;
  history.replaceState(null, '', location.pathname);
  await request('POST', '/api/enter', { token });
}

export const survey = () => get<Survey>('survey');
export const sessions = async () => (await get<{ sessions: Session[] }>('sessions')).sessions;
export const session = (id: string) => get<SessionDetail>(`sessions/${name(id)}`);
/** Of a walk without tracker, or on a floor with a plan; null: of others. */
export const taps = (id: string) => get<Taps>(`sessions/${name(id)}/taps`);
export const overview = async (output: string) => (await source).overview(output);
export const frames = async (output: string, floor: number, box: number[], points: number) => (await source).frames(output, floor, box, points);
export const walk = async (id: string, output: string) => (await source).walk(id, output);
export const scans = async (output: string) => (await source).scans(output);
export const series = async (id: string, output: string) => (await source).series(id, output);
/** Address of a floor's picture. */
export const planAddress = (plan: string) => (folder === null ? plan : `${folder}${plan}`);

export const corrections = () => get<Corrections>('corrections');
export const correctionTables = async () => (await get<{ tables: CorrectionTable[] }>('corrections/tables')).tables;
/** What changes of a text that was made from `base` would make of the file; without a text they are changes of `base`. */
export const preview = (wish: { base: string; text: string | null; changes: Change[] }) => json<Preview>('POST', '/api/corrections/preview', wish);
/** Take back a change that was saved; what others changed stays. */
export const undo = (step: { before: string; after: string }) => json<Undone>('POST', '/api/corrections/undo', step);
export const save = (text: string, version: string) =>
  json<Corrections>('PUT', '/api/corrections', { text }, { 'If-Match': `"${version}"` });

export const process = (ids: string[] | null = null) => json<Job>('POST', '/api/jobs', { kind: 'process', sessions: ids });
export const diagnose = () => json<Job>('POST', '/api/jobs', { kind: 'diagnose' });
export const cancel = (id: number) => json<Job>('DELETE', `/api/jobs/${id}`);
export const jobs = async () => (await get<{ jobs: Job[] }>('jobs')).jobs;
export const diagnosis = () => get<Diagnosis>('diagnosis');
export const invite = async () => (await json<{ url: string }>('POST', '/api/invitations', {})).url;
export const compare = (a: string, b: string) => get<Comparison>('compare', { a, b });
export const makeRadio = () => json<Job>('POST', '/api/jobs', { kind: 'radio' });
export const radio = () => get<Radio>('radio');
export const radioMap = async (floor: number, technology: string, layer: string, bssid: string) => (await source).radioMap(floor, technology, layer, bssid);
export const shared = () => get<Shared>('shared');
export const makeDataset = (wish: { no_ssid: boolean; hash_bssid: boolean }) => json<Job>('POST', '/api/jobs', { kind: 'dataset', ...wish });
export const makePage = () => json<Job>('POST', '/api/jobs', { kind: 'page' });
export const collecting = () => get<Collecting>('collecting');
export const collect = () => json<Collecting>('POST', '/api/collecting', {});
export const endCollecting = () => json<Collecting>('DELETE', '/api/collecting');
export const covered = async () => (await get<{ floors: Covered[] }>('covered')).floors;
export const layers = async () => (await get<{ layers: LayerInfo[] }>('layers')).layers;
export const features = async (layer: string, floor: number) =>
  (await get<{ features: Feature[] }>(`layers/${name(layer)}`, { floor })).features;

/** Bring a file, which the server keeps under a number while it runs. */
export const drop = (file: File) => json<DroppedFile>('POST', `/api/prepare/files?name=${name(file.name)}`, file);
/** An empty level is the first of a file that has levels. */
export const look = (file: number, page: number, level: string) => get<PlanLook>(`prepare/files/${file}/look`, { page, level });
export const pictureOf = (file: number, page: number, level: string) => `/api/prepare/files/${file}/picture?page=${page}&level=${name(level)}`;
export const addFloor = (request: FloorRequest) => json<AddedFloor>('POST', '/api/prepare/floors', request);
export const changeFloor = (change: FloorChange) => json<ChangedFloor>('POST', '/api/prepare/floors/change', change);
export const removeFloor = (floor: number) => json<ChangedFloor>('DELETE', `/api/prepare/floors/${floor}`);
export const plan = (wish: PlanWish) => json<Planned>('POST', '/api/prepare/plans', wish);
export const rooms = (wish: RoomsWish) => json<Rooms>('POST', '/api/prepare/rooms', wish);
export const changePlan = (change: PlanChange) => json<Planned>('POST', '/api/prepare/plans/change', change);
export const writePlan = (change: PlanChange) => json<Written>('POST', '/api/prepare/plans/write', change);
export const makeSheets = (wish: SheetsWish) => json<Sheets>('POST', '/api/prepare/sheets', wish);
export const register = (wish: RegisterWish) => json<Registered>('POST', '/api/prepare/positions', wish);
export const walls = (wish: WallsWish) => json<Walls>('POST', '/api/prepare/walls', wish);
