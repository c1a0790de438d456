// Forms of corrections, made of what the server says an entry of each kind holds.
import type { CorrectionTable, Entry } from '../api/model';
import { named } from '../words/words.svelte';

export interface Field {
  name: string;
  /** Place in a list of values; null: the value is no list. */
  place: number | null;
  kind: 'text' | 'number' | 'choice' | 'tick' | 'moment' | 'names';
  choices: string[];
  required: boolean;
}
export type Values = Record<string, unknown>;
export type Typed = Record<string, string | number | boolean | null | undefined>;

interface Schema {
  type?: string;
  format?: string;
  enum?: string[];
  anyOf?: Schema[];
  items?: Schema;
  minItems?: number;
  $ref?: string;
}

/** Which sessions an entry is for, and why: last in a form. */
const SELECTORS = ['floor', 'device', 'session', 'reason'];

export const keyOf = ({ name, place }: Field): string => (place === null ? name : `${name} ${place + 1}`);

/** Times as the server reads them, from inputs that leave seconds of nought out. */
export const withSeconds = (time: string): string => (time.length === 16 ? `${time}:00` : time);

/** What can be filled in for an entry of a kind. */
export function fieldsOf({ values }: CorrectionTable): Field[] {
  const { properties, required = [], $defs = {} } = values as { properties: Record<string, Schema>; required?: string[]; $defs?: Record<string, Schema> };
  const names = Object.keys(properties);
  return [...names.filter((name) => !SELECTORS.includes(name)), ...SELECTORS.filter((name) => names.includes(name))].flatMap((name) => {
    const { $ref, ...own } = properties[name].anyOf?.[0] ?? properties[name];
    const schema = $ref ? $defs[$ref.slice('#/$defs/'.length)] : own;
    const field = { name, choices: schema.enum ?? [], required: required.includes(name) };
    if (schema.type !== 'array' || !schema.minItems) return [{ ...field, place: null, kind: kindOf(schema) }];
    return Array.from({ length: schema.minItems }, (_, place): Field => ({ ...field, place, kind: kindOf(schema.items ?? {}) }));
  });
}

function kindOf({ type, format, enum: choices }: Schema): Field['kind'] {
  if (choices) return 'choice';
  if (format === 'date-time') return 'moment';
  if (type === 'array') return 'names';
  return type === 'boolean' ? 'tick' : type === 'integer' || type === 'number' ? 'number' : 'text';
}

/** Whether an entry has some values; why it was written does not count, and an empty list selects anything. */
export const holds = (values: Values, some: Values): boolean =>
  Object.entries(some).every(([name, value]) => name === 'reason' || (Array.isArray(value) && !value.length) || comparable(name, values[name]) === comparable(name, value));

/** Ids may be numbers in the file, and their order does not count. */
function comparable(name: string, value: unknown): string {
  if (['ids', 'landmarks', 'sessions'].includes(name) && Array.isArray(value)) return JSON.stringify(value.map(String).sort());
  return name === 'id' ? String(value) : JSON.stringify(value);
}

/** What tells an entry from others, however many stand before it. */
export const identityOf = ({ table, values }: Pick<Entry, 'table' | 'values'>): string => JSON.stringify({ table, values });

/** The entry that was filled in; what is left empty is not in it. */
export function valuesOf(fields: Field[], typed: Typed): Record<string, unknown> {
  const found: Record<string, unknown> = {};
  for (const field of fields) {
    const value = valueOf(field, typed);
    if (value === '' || value === false || (Array.isArray(value) && !value.length)) continue;
    found[field.name] = field.place === null ? value : fields.filter(({ name }) => name === field.name).map((each) => valueOf(each, typed) || (each.kind === 'number' ? 0 : ''));
  }
  return found;
}

function valueOf(field: Field, typed: Typed): string | number | boolean | string[] {
  const value = typed[keyOf(field)] ?? '';
  if (field.kind === 'names') return String(value).split(',').map((name) => name.trim()).filter(Boolean);
  return typeof value !== 'string' ? value : field.kind === 'moment' ? withSeconds(value) : value.trim();
}

/** An entry as it is filled in. */
export const typedOf = (fields: Field[], values: Record<string, unknown>): Typed =>
  Object.fromEntries(fields.map((field) => [keyOf(field), (field.kind === 'names' ? (values[field.name] as string[] | undefined)?.join(', ') : field.place === null ? values[field.name] : (values[field.name] as unknown[])?.[field.place]) as Typed[string]]));

/** Values of an entry in one line. */
export const valuesText = (values: Values): string =>
  Object.entries(values).map(([name, value]) => `${named('field', name)} ${Array.isArray(value) ? value.join(', ') : String(value)}`).join(' · ');
