// Keys and who owns them: of several tools at work the one that began last owns a key; text fields keep their own.
import type { Word } from '../words/words.svelte';

/** What each key does, in words, and the action. By name: a lower-case key, with `mod+` for Ctrl or Cmd and then `shift+`, such as `mod+shift+z`, `l` or `shift+l`. */
export type Shortcuts = Record<string, [Word, () => void]>;

const owners: Shortcuts[] = [];

/** Own keys until the returned function is called; to be called in an effect that returns it. */
export function ownKeys(shortcuts: Shortcuts): () => void {
  owners.push(shortcuts);
  return () => void owners.splice(owners.indexOf(shortcuts), 1);
}

/** The keys that work now, with what they do. */
export const activeKeys = (): [string, Word][] => Object.entries(Object.assign({}, ...owners) as Shortcuts).map(([name, [word]]) => [name, word]);

const CHOICES = ['range', 'checkbox', 'radio', 'button', 'file'];

/** Whether the browser itself needs a key where the focus is. */
function isTaken(target: EventTarget | null, name: string): boolean {
  if (target instanceof HTMLTextAreaElement) return true;
  if (target instanceof HTMLInputElement && !CHOICES.includes(target.type)) return true;
  if (name.startsWith('mod+')) return false;
  if (target instanceof HTMLSelectElement || (target instanceof HTMLInputElement && target.type !== 'range')) return true;
  return name === ' ' && (target instanceof HTMLButtonElement || (target instanceof HTMLElement && target.tagName === 'SUMMARY'));
}

/** Do what the owner of the pressed key does. While a dialog is open no tool is active. */
export function pressed(event: KeyboardEvent): void {
  if (event.altKey || document.querySelector('dialog[open]')) return;
  const key = event.key.toLowerCase();
  const isLetter = key !== event.key.toUpperCase(); // other signs need the shift key on some keyboards
  const name = `${event.ctrlKey || event.metaKey ? 'mod+' : ''}${event.shiftKey && isLetter ? 'shift+' : ''}${key}`;
  const action = owners.findLast((shortcuts) => name in shortcuts)?.[name][1];
  if (!action || isTaken(event.target, name)) return;
  event.preventDefault();
  action();
}
