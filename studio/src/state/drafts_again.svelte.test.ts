import { flushSync } from 'svelte';
import { expect, test, vi } from 'vitest';

vi.mock('../api/client', () => ({ Refusal: class extends Error {}, reading: {} }));

import { formDraft } from './drafts.svelte';

test('a draft is kept also if the tool that opened it first was left before', () => {
  const leave = $effect.root(() => {
    $effect(() => void formDraft('walk', 'a', { device: '' }));
  });
  flushSync();
  leave();
  const draft = formDraft('walk', 'a', { device: '' });
  draft.value.device = 'LG';
  flushSync();
  draft.follow({ device: '' });
  expect([draft.changed, draft.value.device]).toEqual([true, 'LG']);
  expect(Object.values(localStorage).join()).toContain('LG');
});
