// The keyboard's focus is kept: if what has it is removed or disabled, what takes its place gets it.

/** Text fields are left out, because their focus opens the keyboard of a phone. */
const TARGETS = 'a[href], button, select, summary, input:is([type=checkbox], [type=radio], [type=range]), [tabindex]';
/** An element that comes first wherever it is shown, such as the way back to what was left. */
const FIRST = '[data-focus]';

/** What has the focus, and its ancestors with the place of each part among the children, innermost first. */
let held: HTMLElement | null = null;
let levels: { parent: Element; place: number }[] = [];
/** Has the focus in place of a button that waits. */
let standIn: HTMLElement | null = null;

const usable = (element: Element): element is HTMLElement =>
  element.matches(TARGETS) && !element.matches(':disabled, [tabindex="-1"]') && element.checkVisibility();
const firstIn = (part: Element | undefined) => part && [part, ...part.querySelectorAll(TARGETS)].find(usable);

function hold(element: HTMLElement): void {
  [held, levels] = [element, []];
  for (let part: Element = element; part.parentElement; part = part.parentElement)
    levels.push({ parent: part.parentElement, place: [...part.parentElement.children].indexOf(part) });
}

function nearest(): HTMLElement | undefined {
  const dialog = document.querySelector('dialog[open]');
  if (dialog) return firstIn(dialog);
  for (const { parent, place } of levels) {
    if (!parent.isConnected) continue;
    const first = [...parent.querySelectorAll(FIRST)].find(usable);
    const found = first ?? firstIn(parent.children[place]) ?? firstIn(parent.children[place - 1]) ?? firstIn(parent);
    if (found) return found;
  }
}

function look(): void {
  const active = document.activeElement as HTMLElement;
  if (active === standIn && held?.isConnected && !held.matches(':disabled')) return held.focus();
  const isLost = active === document.body || active.matches(':disabled') || !active.checkVisibility();
  if (!isLost) {
    if (active !== standIn && !active.closest('dialog')) hold(active);
  } else if (held) {
    const waits = held.isConnected && held.matches(':disabled');
    const found = nearest();
    standIn = waits && found ? found : null;
    found?.focus();
  }
}

/** Until the returned function is called. */
export function keepFocus(): () => void {
  const watcher = new MutationObserver(look);
  watcher.observe(document.body, { childList: true, subtree: true, attributeFilter: ['disabled', 'open'] });
  const stop = new AbortController();
  const { signal } = stop;
  document.addEventListener('focusin', look, { signal });
  document.addEventListener('keydown', () => (standIn = null), { signal, capture: true });
  document.addEventListener('pointerdown', ({ target }) => (target as Element).closest(`${TARGETS}, input, textarea, label`) || (held = null), { signal, capture: true });
  return () => {
    watcher.disconnect();
    stop.abort();
  };
}
