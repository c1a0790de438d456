// Faults by what was done about them, from the corrections as they are now: labels and diagnosis follow only after a while.
import type { Change, Entry, Fault } from '../api/model';
import type { Spot } from './choice.svelte';
import { data } from './data.svelte';
import { type Values, holds } from './entries';

export type State = 'open' | 'corrected' | 'ignored';
export interface Standing {
  fault: Fault;
  state: State;
  /** Its corrections in the file, or the entry that ignores it. */
  entries: Entry[];
}

/** An entry with one of these that a change does not have holds for less than the change. */
const SELECTORS = ['session', 'device', 'from', 'until'];

function entryOf({ table, ...change }: Change): Entry | undefined {
  if (!('values' in change)) return undefined;
  const wanted = change.values as Values;
  return data.corrections.entries.find(
    ({ table: own, values }) => own === table && holds(values, wanted) && SELECTORS.every((name) => name in wanted || !(name in values)),
  );
}

function standing(fault: Fault): Standing {
  const ignoring = data.corrections.entries.find(({ table, values }) => table === fault.ignore.table && holds(fault.ignore.values, values));
  if (ignoring) return { fault, state: 'ignored', entries: [ignoring] };
  const ways = fault.changes.length ? [fault.changes] : fault.alternatives.map((change) => [change]);
  const written = ways.map((way) => way.map(entryOf)).find((found) => found.every(Boolean)) as Entry[] | undefined;
  return { fault, state: written ? 'corrected' : 'open', entries: written ?? [] };
}

/** What corrects a fault for certain and is not in the file yet. */
export const changesOf = (fault: Fault): Change[] => fault.changes.filter((change) => !entryOf(change));

class Standings {
  all = $derived((data.diagnosis?.faults ?? []).map(standing));
  open = $derived(this.all.filter(({ state }) => state === 'open').map(({ fault }) => fault));
}

const known = new Standings();
export const standings = (): Standing[] => known.all;
export const openFaults = (): Fault[] => known.open;

/** What to bring into view for a fault: its places, else the walk it is about. */
export function spotsOf(fault: Fault): Spot[] {
  if (fault.places.length) return fault.places.flatMap(({ floor, x, y, to_x, to_y }) => [{ floor, x, y }, ...(to_x === null || to_y === null ? [] : [{ floor, x: to_x, y: to_y }])]);
  const bounds = Object.entries(data.byId.get(fault.sessions[0])?.bounds ?? {}).slice(0, 1);
  return bounds.flatMap(([floor, [left, right, low, high]]) => [{ floor: Number(floor), x: left, y: low }, { floor: Number(floor), x: right, y: high }]);
}
