import { expect, test } from 'vitest';
import { de } from './de';
import { en } from './en';
import { said } from './sentences';
import german from './sentences.de.json';
import english from './sentences.en.json';
import { clock, coordinates, minutes, named, t, words } from './words.svelte';

const places = (text: string) => [...text.matchAll(/\{\w+\}/g)].map(String).sort();

test('every German text has the places of the English one', () => {
  for (const word of Object.keys(en) as (keyof typeof en)[]) expect([word, places(de[word])]).toEqual([word, places(en[word])]);
});

test('texts follow the language, unknown names are shown as they are', () => {
  words.language = 'de';
  expect(t('walks.count', { shown: 2, all: 3 })).toBe('2 von 3 Aufnahmen');
  expect(t('walks.count', { shown: 1, all: 1 })).toBe('1 von 1 Aufnahme');
  expect(t('result.labelled', { count: 2, before: '1 %', after: '90 %' })).toBe('2 Aufnahmen: 1 % → 90 % mit Label');
  expect(coordinates([4.042, -0.001])).toBe('4,04; 0,00');
  expect(named('colour', 'age')).toBe('Alter');
  expect(named('colour', 'not_known')).toBe('not known');
  words.language = 'en';
});

test('seconds as minutes', () => {
  expect([0, 129.6, 36.7, -3].map(minutes)).toEqual(['0:00', '2:10', '0:37', '0:00']);
  expect([0, 61.25, -3].map(clock)).toEqual(['0:00.0', '1:01.2', '0:00.0']);
});

test('sentences of the server are German where the page is, their parts too', () => {
  const evidence = '7 observations of landmarks fit with this correction, but hardly any without it; the table is certainly mirrored, but the axis is uncertain: check it on the plan';
  expect(said('landmark 11 of floor 1 is at (7.2, 21.93) ± 0.08 m, 2.9 m from its position in the table')).toMatch(/^landmark 11/);
  words.language = 'de';
  expect(said('landmark 11 of floor 1 is at (7.2, 21.93) ± 0.08 m, 2.9 m from its position in the table')).toBe(
    'Landmarke 11 von Stockwerk 1 ist bei (7,2; 21,93) ± 0,08 m, 2,9 m entfernt von der Angabe der Tabelle',
  );
  expect(said(evidence)).toMatch(/^7 Beobachtungen von Landmarken passen mit dieser Korrektur, ohne sie kaum eine; die Tabelle ist sicher gespiegelt/);
  expect(said('landmarks 2, 9 and 4 of floor 1 are mixed up: 2 where 9 should')).toBe(
    'die Landmarken 2, 9 und 4 von Stockwerk 1 sind durcheinander: 2, wo 9 sein sollte',
  );
  expect(said('floor 2: has no walkable path; check its plan and scale (vislam2tag site show)')).toBe(
    'Stockwerk 2: hat keinen begehbaren Weg; bitte Plan und Maßstab prüfen (vislam2tag site show)',
  );
  expect(said('S1.txt: no such thing, of 3')).toBe('S1.txt: no such thing, of 3');
  expect(said('100 % of the walk has no position, because the plan of floor 2 fits it about as well as that of floor 0. Check that the session is on this floor; a tap on a known place settles it')).toBe(
    '100 % der Aufnahme haben keine Position: der Plan von Stockwerk 2 passt etwa ebenso gut wie der von Stockwerk 0. Bitte prüfen, ob die Aufnahme auf diesem Stockwerk ist; Antippen an einem bekannten Ort klärt es',
  );
  expect(said('Tap one known place in the studio, or add set_tap to corrections.toml')).toMatch(/eintragen$/);
  expect(said('Tap one known place in the studio, or add set_tap to corrections.toml, best where the walk was at 0:28 (at_s = 28)')).toMatch(/eintragen, am besten den bei 0:28 \(at_s = 28\)$/);
  expect(said('something else')).toBe('something else');
  words.language = 'en';
});

test.each(['en', 'de'] as const)('no sentence of the server names an option of the command line (%s)', (language) => {
  words.language = language;
  const filled = Object.keys(german).map((sentence) => sentence.replace(/\{(\d+)\}/g, 'part$1'));
  const naming = filled.filter((sentence) => said(sentence).includes('--'));
  words.language = 'en';
  expect(naming).toEqual([expect.stringMatching(/run: vislam2tag process SURVEY --out LABELS --together$/)]); // a command to run
});

test('what the page says instead of options is about sentences that the server has', () => {
  expect(Object.keys(english).filter((sentence) => !(sentence in german))).toEqual([]);
  expect(said('floor 2: has no wall for a sheet; allow larger sheets (--paper A1) or fewer forbidden places')).toBe(
    'floor 2: has no wall for a sheet; allow larger sheets (A1 under \'Paper\') or fewer forbidden places',
  );
});

test('no sentence has a minus before zero', () => {
  expect(said('Landmark 3 is placed at (-0.00, -0.05) since -0.')).toBe('Landmark 3 is placed at (0.00, -0.05) since 0.');
  expect(said('65 instead of -0.04 on 2021-0-0')).toBe('65 instead of -0.04 on 2021-0-0');
});
