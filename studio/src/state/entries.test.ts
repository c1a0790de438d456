import { expect, test } from 'vitest';
import { fieldsOf, holds, typedOf, valuesOf } from './entries';

const table = {
  name: 'turn_landmarks',
  summary: '',
  values: {
    properties: {
      floor: { type: 'integer' },
      reason: { type: 'string' },
      mirrored: { type: 'boolean' },
      turn_deg: { type: 'number' },
      shift_m: { type: 'array', items: { type: 'number' }, minItems: 2 },
      landmarks: { type: 'array', items: { type: 'string' } },
      kind: { $ref: '#/$defs/Kind' },
      unit: { enum: ['ft', 'cm'], type: 'string' },
      from: { anyOf: [{ type: 'string', format: 'date-time' }, { type: 'null' }] },
    },
    required: ['floor'],
    $defs: { Kind: { enum: ['moved', 'swapped'], type: 'string' } },
  },
};
const fields = fieldsOf(table);

test('every value of a kind has a field, a list one for each place, which sessions it is for comes last', () => {
  expect(fields.map(({ name, place, kind }) => [name, place, kind])).toEqual([
    ['mirrored', null, 'tick'],
    ['turn_deg', null, 'number'],
    ['shift_m', 0, 'number'],
    ['shift_m', 1, 'number'],
    ['landmarks', null, 'names'],
    ['kind', null, 'choice'],
    ['unit', null, 'choice'],
    ['from', null, 'moment'],
    ['floor', null, 'number'],
    ['reason', null, 'text'],
  ]);
  expect(fields.filter(({ required }) => required).map(({ name }) => name)).toEqual(['floor']);
});

test('what is left empty is not in the entry, times have seconds, a list is whole', () => {
  expect(valuesOf(fields, { floor: 1, reason: ' ', mirrored: false, 'shift_m 2': 4.5, from: '2022-01-10T08:30' })).toEqual({
    floor: 1,
    shift_m: [0, 4.5],
    from: '2022-01-10T08:30:00',
  });
  expect(valuesOf(fields, { 'shift_m 1': null, unit: '', mirrored: true })).toEqual({ mirrored: true });
});

test('an entry is filled in as it is', () => {
  const values = { landmarks: ['2', '9'], mirrored: true, shift_m: [1, 2], unit: 'ft', floor: 0 };
  expect(valuesOf(fields, typedOf(fields, values))).toEqual(values);
});

test('an entry has values whatever its reason, and an empty list selects anything', () => {
  const fault = { kind: 'moved', floor: 1, landmarks: ['4'] };
  expect(holds({ ...fault, reason: 'a' }, { ...fault, reason: 'b' })).toBe(true);
  expect(holds(fault, { kind: 'moved', landmarks: [], reason: 'known' })).toBe(true);
  expect(holds(fault, { kind: 'moved', floor: 2 })).toBe(false);
  expect(holds(fault, { kind: 'moved', landmarks: ['4', '5'] })).toBe(false);
});
