import { expect, test } from 'vitest';
import { de } from './de';
import { en } from './en';
import { clock, named, t, words } from './words.svelte';

const places = (text: string) => [...text.matchAll(/\{\w+\}/g)].map(String).sort();

test('every German text has the places of the English one', () => {
  for (const word of Object.keys(en) as (keyof typeof en)[]) expect([word, places(de[word])]).toEqual([word, places(en[word])]);
});

test('texts follow the language, unknown names are shown as they are', () => {
  words.language = 'de';
  expect(t('walks.count', { shown: 2, all: 3 })).toBe('2 von 3 Aufnahmen');
  expect(named('colour', 'age')).toBe('Alter');
  expect(named('colour', 'not_known')).toBe('not known');
  words.language = 'en';
});

test('seconds as minutes', () => {
  expect([0, 61.25, -3].map(clock)).toEqual(['0:00.0', '1:01.2', '0:00.0']);
});
