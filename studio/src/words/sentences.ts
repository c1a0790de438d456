// Sentences of the server, with {1}, {2}, ... for what varies: in German, and in English those that name an option of the
// command line where the page has a control.
import german from './sentences.de.json';
import english from './sentences.en.json';
import { type Language, words } from './words.svelte';

interface Pattern extends Record<Language, string> {
  whole: RegExp;
}

const inEnglish: Record<string, string> = english;
const pattern = ([sentence, text]: [string, string]): Pattern => ({
  whole: new RegExp(`^${sentence.replace(/[.*+?^$()|[\]\\]/g, '\\$&').replace(/\{\d+\}/g, '([^]*?)')}$`),
  de: text,
  en: inEnglish[sentence] ?? sentence,
});

/** Those that say most first: what fits several is the most specific one. */
const patterns = Object.entries(german)
  .sort(([one], [other]) => other.replace(/\{\d+\}/g, '').length - one.replace(/\{\d+\}/g, '').length)
  .map(pattern);
const known: Record<Language, Map<string, string>> = { de: new Map(), en: new Map() };

/** A sentence of the server in the page's language; one that is not known stays as it is. */
export function said(sentence: string): string {
  const { language } = words;
  let found = known[language].get(sentence);
  if (found === undefined) known[language].set(sentence, (found = translated(withoutMinusZero(sentence), language)));
  return found;
}

function translated(sentence: string, language: Language): string {
  for (const { whole, [language]: text } of patterns) {
    const parts = whole.exec(sentence);
    if (parts) return text.replace(/\{(\d+)\}/g, (_, place: string) => translated(language === 'de' ? inGerman(parts[Number(place)]) : parts[Number(place)], language));
  }
  return sentence;
}

const withoutMinusZero = (sentence: string): string => sentence.replace(/(?<![\w.+-])-(0(\.0+)?)(?!\.?\d|\w)/g, '$1');
const inGerman = (part: string): string => withCommas(listed(part));

/** Numbers as Germans write them, such as 4,04; 4,29: texts that are nothing but numbers, with signs or a unit. */
const withCommas = (part: string): string =>
  /^[-+±(]*\d+\.\d+(, -?\d+(\.\d+)?)*\)?( [%m])?$|^[-+±(]*\d+(, -?\d+\.\d+)+\)?( [%m])?$/.test(part) ? part.replaceAll(', ', '; ').replaceAll('.', ',') : part;

/** Names between commas and "and". */
const listed = (part: string): string => (/^[\w.:\-/ ]+(, [\w.:\-/ ]+)* and [\w.:\-/]+$/.test(part) ? part.replace(/ and ([^ ]+)$/, ' und $1') : part);
