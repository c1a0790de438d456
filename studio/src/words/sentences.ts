// Sentences of the server, which speaks English, in German: sentences.de.json has them with {1}, {2}, ... for what varies.
import german from './sentences.de.json';
import { words } from './words.svelte';

interface Pattern {
  whole: RegExp;
  german: string;
}

const pattern = ([english, text]: [string, string]): Pattern => ({
  whole: new RegExp(`^${english.replace(/[.*+?^$()|[\]\\]/g, '\\$&').replace(/\{\d+\}/g, '([^]*?)')}$`),
  german: text,
});

/** Those that say most first: what fits several is the most specific one. */
const patterns = Object.entries(german)
  .sort(([one], [other]) => other.replace(/\{\d+\}/g, '').length - one.replace(/\{\d+\}/g, '').length)
  .map(pattern);
const known = new Map<string, string>();

/** A sentence of the server in the page's language; one that is not known stays English. */
export function said(sentence: string): string {
  if (words.language !== 'de') return sentence;
  let found = known.get(sentence);
  if (found === undefined) known.set(sentence, (found = inGerman(sentence)));
  return found;
}

function inGerman(sentence: string): string {
  for (const { whole, german } of patterns) {
    const parts = whole.exec(sentence);
    if (parts) return german.replace(/\{(\d+)\}/g, (_, place: string) => inGerman(withCommas(listed(parts[Number(place)]))));
  }
  return sentence;
}

/** Numbers as Germans write them, such as 4,04; 4,29: texts that are nothing but numbers, with signs or a unit. */
const withCommas = (part: string): string =>
  /^[-+±(]*\d+\.\d+(, -?\d+(\.\d+)?)*\)?( [%m])?$|^[-+±(]*\d+(, -?\d+\.\d+)+\)?( [%m])?$/.test(part) ? part.replaceAll(', ', '; ').replaceAll('.', ',') : part;

/** Names between commas and "and". */
const listed = (part: string): string => (/^[\w.:\-/ ]+(, [\w.:\-/ ]+)* and [\w.:\-/]+$/.test(part) ? part.replace(/ and ([^ ]+)$/, ' und $1') : part);
