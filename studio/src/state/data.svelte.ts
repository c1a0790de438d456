// What the server holds, kept as it is there.
import { t } from '../words/words.svelte';
import type { Track } from '../api/arrow';
import * as api from '../api/client';
import type { Collecting, CorrectionTable, Corrections, Diagnosis, Job, LayerInfo, Session, Shared, Survey, Versions } from '../api/model';

class Data {
  survey = $state.raw<Survey | null>(null);
  sessions = $state.raw<Session[]>([]);
  overview = $state.raw<Track | null>(null);
  scans = $state.raw<Track | null>(null);
  corrections = $state.raw<Corrections>({ version: '', text: '', entries: [], problem: null });
  diagnosis = $state.raw<Diagnosis | null>(null);
  /** All kinds of corrections. */
  tables = $state.raw<CorrectionTable[]>([]);
  layers = $state.raw<LayerInfo[]>([]);
  /** Where phones hand over, and what they did. */
  collecting = $state.raw<Collecting | null>(null);
  /** Data set and page that were built of the survey. */
  shared = $state.raw<Shared | null>(null);
  jobs = $state.raw<Job[]>([]);
  /** The output that walks are drawn from: labels, before, or one to compare with. */
  output = $state('labels');
  /** Number of the last job of which what it changed is loaded. */
  settled = $state(0);
  /** Whether somebody asked for something while the studio did not answer. */
  undone = false;
  /** Counts up as labels change, for what is loaded of them elsewhere. */
  generation = $state(0);
  problem = $state('');
  /** What was done last, for the status line and readers of the screen. */
  notice = $state('');
  /** Why this browser is not let in; null: it is. */
  refused = $state<'link_used' | 'restarted' | 'entry' | null>(null);
  /** Nothing answers at the page's address: the studio has ended, or the network is down. */
  lost = $state(false);
  /** The server of an export gives whole files where a part is asked for. */
  wholeFiles = $state(false);

  job = $derived(this.jobs.find((job) => job.state === 'running' || job.state === 'queued') ?? null);
  isBusy = (kind: Job['kind']): boolean => this.jobs.some((job) => job.kind === kind && (job.state === 'queued' || job.state === 'running'));
  /** Ask for the survey and its sessions again. */
  reload = (): Promise<void> => loadSurvey();
  byId = $derived(new Map(this.sessions.map((session) => [session.id, session])));
  /** To be called once there is something to show. */
  opened: () => void = () => {};
}

export const data = new Data();
api.reading.whole = () => (data.wholeFiles = true);

/** Do what somebody asked for; what goes wrong is shown in place of what went wrong before. */
export async function attempt(work: () => Promise<void>): Promise<boolean> {
  data.problem = ''; // not at its end: what began before must not hide what went wrong since
  const done = await follow(work);
  if (!done && reconnecting) data.undone = true;
  return done;
}

/** Do what nobody asked for, such as loading what has changed; what goes wrong is shown. Returns whether it went well. */
export async function follow(work: () => Promise<void>): Promise<boolean> {
  try {
    await work();
    return true;
  } catch (error) {
    if (error instanceof api.Unreachable) {
      void reconnect();
      return false;
    }
    const { code, corrections } = error instanceof api.Refusal ? error.problem : {};
    if (code === 'link_used') data.refused = code;
    if (code === 'entry_needed') data.refused = data.survey ? 'restarted' : 'entry';
    if (corrections) data.corrections = corrections;
    data.problem = error instanceof Error ? error.message : String(error);
    return false;
  }
}

/** Draw the labels before the last change, or the labels again. */
export function flipOutput(): void {
  data.output = data.output === 'labels' ? 'before' : 'labels';
  void attempt(loadTracks);
}

export async function loadTracks(): Promise<void> {
  const output = data.output;
  const [overview, scans] = await Promise.all([api.overview(output), api.scans(output)]);
  if (output !== data.output) return;
  [data.overview, data.scans] = [overview, scans];
  data.generation++;
}

/** Asks for something anew; an answer that comes after that of a later question is dropped. */
function newest<T>(ask: () => Promise<T>, take: (answer: T) => void): () => Promise<void> {
  let [asked, taken] = [0, 0];
  return async () => {
    const mine = ++asked;
    const answer = await ask();
    if (mine > taken) take(answer);
    taken = Math.max(taken, mine);
  };
}

const loadSurvey = newest(() => Promise.all([api.survey(), api.sessions()]), (answer) => ([data.survey, data.sessions] = answer));
export const loadDiagnosis = newest(() => api.diagnosis(), (answer) => (data.diagnosis = answer));

/** Enter and load everything, also again: after a new link, or once a studio answers again. */
export async function start(): Promise<void> {
  data.problem = '';
  await follow(async () => {
    await api.enter();
    [data.survey, data.sessions, data.layers, data.corrections] = await Promise.all([api.survey(), api.sessions(), api.layers(), api.corrections()]);
    data.refused = null;
    data.opened();
    await Promise.all([loadTracks(), api.readOnly ? null : loadRest()]);
    if (!api.readOnly) listen();
    await loadDiagnosis();
  });
}

async function loadRest(): Promise<void> {
  [data.tables, data.collecting, data.shared] = await Promise.all([api.correctionTables(), api.collecting(), api.shared()]);
}

async function loadShared(): Promise<void> {
  data.shared = await api.shared();
}

const [FIRST_MS, LONGEST_MS] = [200, 5000];
let wait = FIRST_MS;
let reconnecting = false;

/** Ask until something answers at the page's address, then load everything again. */
async function reconnect(): Promise<void> {
  if (reconnecting) return;
  reconnecting = true;
  events?.close();
  for (;;) {
    await new Promise((done) => setTimeout(done, wait));
    wait = Math.min(2 * wait, LONGEST_MS);
    if (await api.isReachable()) break;
    [data.lost, data.jobs] = [true, []];
  }
  if (data.lost) wait = FIRST_MS; // what answers but ends its events again and again is asked less often
  reconnecting = data.lost = false;
  [data.jobs, data.settled] = [[], 0]; // a studio that was started again counts from one
  await start();
  if (data.undone) data.problem ||= t('lost.undone');
  data.undone = false;
}

async function loadCorrections(): Promise<void> {
  data.corrections = await api.corrections();
}

let events: EventSource | null = null;

/** Hear of changes: by this page, the terminal or a second studio. */
function listen(): void {
  let known: Versions | null = null;
  events?.close();
  const source = (events = new EventSource('/api/events'));
  source.onerror = () => void reconnect();
  const compare = (event: MessageEvent<string>) => {
    const now = JSON.parse(event.data) as Versions;
    const before = known ?? { ...now, corrections: data.corrections.version }; // which may have changed since they were loaded
    known = now;
    void follow(async () => {
      if (now.survey !== before.survey || now.sessions !== before.sessions) await loadSurvey();
      if (now.corrections !== before.corrections) await loadCorrections();
      if (now.labels !== before.labels) await Promise.all([loadTracks(), loadShared()]);
      if (now.labels !== before.labels || now.corrections !== before.corrections) await loadDiagnosis();
    });
  };
  source.addEventListener('hello', (event: MessageEvent<string>) => {
    compare(event);
    void follow(async () => {
      const earlier = await api.jobs();
      data.jobs = [...earlier.filter(({ id }) => !data.jobs.some((job) => job.id === id)), ...data.jobs];
      const ended = earlier.filter(({ state }) => state !== 'queued' && state !== 'running');
      data.settled = Math.max(data.settled, ...ended.map(({ id }) => id));
    });
  });
  source.addEventListener('versions', compare);
  source.addEventListener('collecting', (event: MessageEvent<string>) => {
    data.collecting = JSON.parse(event.data) as Collecting;
  });
  source.addEventListener('job', (event: MessageEvent<string>) => {
    const job = JSON.parse(event.data) as Job;
    data.jobs = [...data.jobs.filter(({ id }) => id !== job.id), job];
    if (job.state === 'failed') data.problem = job.error ?? '';
    if (job.state === 'done') data.notice = job.kind === 'process' ? t('change.done') : '';
    if (job.state === 'done' || job.state === 'failed') void follow(async () => {
      await Promise.all([loadSurvey(), loadTracks(), loadDiagnosis(), loadShared()]);
      data.settled = Math.max(data.settled, job.id);
      if (job.kind === 'diagnose' && job.state === 'done') data.notice = t('diagnose.done');
    });
  });
}
