import { afterEach, beforeEach, expect, test } from 'vitest';
import { activeKeys, ownKeys, pressed } from './shortcuts';

let done: string[] = [];
let release: (() => void)[] = [];
const own = (name: string, ...keys: string[]) => release.push(ownKeys(Object.fromEntries(keys.map((key) => [key, ['app.undo', () => void done.push(`${name} ${key}`)]]))));

function press(key: string, on: HTMLElement = document.body, init: KeyboardEventInit = {}): KeyboardEvent {
  const event = new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true, ...init });
  on.addEventListener('keydown', (found) => pressed(found as KeyboardEvent), { once: true });
  on.dispatchEvent(event);
  return event;
}
const element = (html: string) => {
  document.body.innerHTML = html;
  return document.body.firstElementChild as HTMLElement;
};
const CTRL = { ctrlKey: true };

beforeEach(() => (done = []));
afterEach(() => {
  release.forEach((free) => free());
  release = [];
  document.body.innerHTML = '';
});

test('of several owners of a key the last one has it until it is released', () => {
  own('page', 'mod+z', 'l');
  own('walls', 'mod+z');
  press('z', document.body, CTRL);
  press('l');
  expect(activeKeys().map(([key]) => key)).toEqual(['mod+z', 'l']);
  release.pop()!();
  press('z', document.body, CTRL);
  press('Z', document.body, { ...CTRL, shiftKey: true });
  expect(done).toEqual(['walls mod+z', 'page l', 'page mod+z']);
});

test.each(['<textarea></textarea>', '<input>', '<input type="number">', '<input type="datetime-local">'])('keys in %s are the browser’s', (html) => {
  own('page', 'mod+z', 'l', ' ');
  const field = element(html);
  expect(press('z', field, CTRL).defaultPrevented).toBe(false);
  press('l', field);
  press(' ', field);
  expect(done).toEqual([]);
});

test('what is no text takes only the keys that it needs itself', () => {
  own('page', 'mod+z', 'l', ' ');
  for (const html of ['<button></button>', '<select></select>', '<input type="checkbox">', '<input type="range">']) {
    const part = element(html);
    press('z', part, CTRL);
    press('l', part);
    press(' ', part);
  }
  expect(done.filter((each) => each === 'page mod+z')).toHaveLength(4);
  expect(done.filter((each) => each === 'page l')).toHaveLength(2);
  expect(done.filter((each) => each === 'page  ')).toHaveLength(1);
});

test('an open dialog leaves no key to a tool', () => {
  own('page', 'mod+z');
  element('<dialog open></dialog>');
  press('z', document.body, CTRL);
  expect(done).toEqual([]);
});
