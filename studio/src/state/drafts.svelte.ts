// What was typed or painted and is not saved yet: it survives a change of tab, every event of the server and a reload.
import { untrack } from 'svelte';
import { data } from './data.svelte';

/** Counts up when drafts of an older page cannot be read any more. */
const VERSION = 1;

interface Kept<T> {
  version: number;
  basis: string;
  value: T;
}

/** As text, without what is left empty: an empty field is like one that was never filled in. */
const textOf = (value: unknown) => JSON.stringify(value, (_, part: unknown) => (part === null || part === '' || part === false ? undefined : part));

/** A value that Svelte follows in depth, for forms. */
function followed<T>(value: T): T {
  const live = $state(value);
  return live;
}

export class Draft<T> {
  /** Of a form followed in depth, else replaced as a whole. */
  value = $state.raw() as T;
  /** What the draft was begun from, such as the text of a file. */
  basis = $state('');
  /** What it would be begun from now. */
  now = $state('');
  private initial = $state('');
  readonly changed = $derived(textOf(this.value) !== this.initial);
  /** Whether what the draft was begun from is another now. */
  readonly outdated = $derived(this.changed && this.basis !== this.now);

  constructor(
    private readonly key: string,
    initial: T,
    basis: string,
    private readonly deep: boolean,
  ) {
    const kept = read<T>(key);
    this.initial = textOf(initial);
    this.value = this.of(kept?.value ?? initial);
    [this.basis, this.now] = [kept?.basis ?? basis, basis];
    $effect(() => write(this.key, this.changed ? { version: VERSION, basis: this.basis, value: this.value } : null));
  }

  private of(value: T): T {
    const copy = JSON.parse(JSON.stringify(value)) as T;
    return this.deep ? followed(copy) : copy;
  }

  /** Follow what a draft begins from; one that was changed stays as it is. To be called in an effect. */
  follow(initial: T, basis = textOf(initial)): void {
    untrack(() => {
      this.now = basis;
      if (!this.changed) this.begin(initial, basis);
    });
  }

  /** Forget what was typed; after it was saved, too. */
  discard(initial: T, basis = textOf(initial)): void {
    this.now = basis;
    this.begin(initial, basis);
  }

  private begin(initial: T, basis: string): void {
    const text = textOf(initial);
    if (textOf(this.value) !== text) this.value = this.of(initial);
    [this.initial, this.basis] = [text, basis];
  }
}

// eslint-disable-next-line svelte/prefer-svelte-reactivity -- drafts are made while components are, where nothing may change that they follow
const live = new Map<string, Draft<unknown>>();
/** Whether the browser refuses to store drafts, so that a reload loses them; and how often one began or ended. */
export const keeping = $state({ refused: false, changes: 0 });

const keyOf = (tool: string, place: string) => `vislam2tag-draft ${JSON.stringify([data.survey?.root ?? '', tool, place])}`;

function draftOf<T>(tool: string, place: string, initial: T, basis: string, deep: boolean): Draft<T> {
  return untrack(() => {
    const key = keyOf(tool, place);
    // In a root of its own, so that it is followed after the component is gone that opened it first.
    if (!live.has(key)) $effect.root(() => void live.set(key, new Draft<unknown>(key, initial, basis, deep)));
    return live.get(key) as Draft<T>;
  });
}

/** The draft of a form: the same one each time for a tool and a place, such as a floor or a walk. */
export const formDraft = <T>(tool: string, place: string, initial: T, basis = textOf(initial)): Draft<T> => draftOf(tool, place, initial, basis, true);

/** The draft of what is painted or planned, which is always replaced as a whole. */
export const paintedDraft = <T>(tool: string, place: string, initial: T, basis: string): Draft<T> => draftOf(tool, place, initial, basis, false);

/** Places of a tool's drafts in this browser, for example the floors that have one. */
export function placesOf(tool: string): string[] {
  void keeping.changes;
  const start = keyOf(tool, '').slice(0, -'""]'.length);
  const keys = Array.from({ length: storage()?.length ?? 0 }, (_, at) => storage()!.key(at)!);
  return keys.filter((key) => key.startsWith(start)).map((key) => (JSON.parse(key.slice(key.indexOf('['))) as string[])[2]);
}

function storage(): Storage | null {
  try {
    return localStorage;
  } catch {
    return null;
  }
}

function read<T>(key: string): Kept<T> | null {
  try {
    const kept = JSON.parse(storage()?.getItem(key) ?? 'null') as Kept<T> | null;
    return kept?.version === VERSION ? kept : null;
  } catch {
    return null;
  }
}

function write(key: string, kept: Kept<unknown> | null): void {
  try {
    const had = localStorage.getItem(key) !== null;
    if (kept === null) localStorage.removeItem(key);
    else localStorage.setItem(key, JSON.stringify(kept));
    if (had !== (kept !== null)) untrack(() => keeping.changes++);
  } catch {
    keeping.refused = true;
  }
}
