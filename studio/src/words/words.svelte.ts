// Words of the page in English and German.
import { de } from './de';
import { en } from './en';

export type Word = keyof typeof en;
export type Language = 'en' | 'de';

class Words {
  language = $state<Language>(
    (localStorage.getItem('language') ?? navigator.language).startsWith('de') ? 'de' : 'en',
  );

  switch(): void {
    this.language = this.language === 'de' ? 'en' : 'de';
    localStorage.setItem('language', this.language);
  }
}

export const words = new Words();

/** The text of a word, its {names} replaced, and {name?one:many} by what fits the number of that name. */
export function t(word: Word, values: Record<string, string | number> = {}): string {
  const text: string = (words.language === 'de' ? de : en)[word];
  return text
    .replace(/\{(\w+)\?([^:]*?):((?:[^{}]|\{\w+\})*)\}/g, (_, name: string, one: string, many: string) => (String(values[name]) === '1' ? one : many))
    .replace(/\{(\w+)\}/g, (whole, name: string) => String(values[name] ?? whole));
}

/** A word that may be unknown here, such as a kind that a newer server knows: shown as it is. */
export function named(group: string, name: string): string {
  const word = `${group}.${name}`;
  return word in en ? t(word as Word) : name.replaceAll('_', ' ');
}

export const number = (value: number | null | undefined, digits = 1): string =>
  value === null || value === undefined || Number.isNaN(value)
    ? '–'
    : value.toLocaleString(words.language, { minimumFractionDigits: digits, maximumFractionDigits: digits, signDisplay: 'negative' });

/** Coordinates, such as 4.04, 4.29, in German 4,04; 4,29. */
export const coordinates = (values: (number | null | undefined)[], digits = 2): string => values.map((value) => number(value, digits)).join(words.language === 'de' ? '; ' : ', ');

export const percent = (share: number | null | undefined): string =>
  share === null || share === undefined ? '–' : `${number(share * 100, 1)} %`;

/** Minutes and whole seconds, such as 2:10. */
export function minutes(seconds: number): string {
  const whole = Math.max(0, Math.round(seconds));
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, '0')}`;
}

export function clock(seconds: number): string {
  const whole = Math.max(0, Math.floor(seconds));
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, '0')}.${Math.floor((Math.max(0, seconds) % 1) * 10)}`;
}
