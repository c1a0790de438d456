import { beforeEach, expect, test, vi } from 'vitest';

vi.mock('../api/client', () => ({ Refusal: class extends Error {}, reading: {} }));
vi.setConfig({ testTimeout: 60_000 });

const SURVEY = { root: '/surveys/one' };

/** What followed a change is done. */
const settled = () => new Promise((done) => setTimeout(done));

/** The state as a page that is loaded has it; drafts in the browser stay. */
async function loaded(survey: { root: string } = SURVEY) {
  await settled();
  vi.resetModules();
  const { data } = await import('./data.svelte');
  data.survey = survey as never;
  return import('./drafts.svelte');
}

beforeEach(() => localStorage.clear());

test('a form is there again for its tool and place, in its survey, after a reload', async () => {
  const first = await loaded();
  const draft = first.formDraft('walk', 'a', { device: '' });
  expect(draft.changed).toBe(false);
  draft.value.device = 'LG';
  expect(first.formDraft('walk', 'a', { device: '' }).value.device).toBe('LG');
  const again = await loaded();
  expect(again.placesOf('walk')).toEqual(['a']);
  expect(again.formDraft('walk', 'a', { device: '' })).toMatchObject({ changed: true, outdated: false, value: { device: 'LG' } });
  expect(again.formDraft('walk', 'b', { device: '' }).changed).toBe(false);
  const other = await loaded({ root: '/surveys/two' });
  expect(other.formDraft('walk', 'a', { device: '' }).changed).toBe(false);
});

test('what was saved or discarded is not kept', async () => {
  const first = await loaded();
  const draft = first.formDraft('walk', 'a', { device: '' });
  draft.value.device = 'LG';
  await settled();
  expect(localStorage).toHaveLength(1);
  draft.discard({ device: '' });
  await settled();
  expect(localStorage).toHaveLength(0);
  expect(draft.value.device).toBe('');
});

test('a draft of a file that is another now stays and says so; an untouched one follows the file', async () => {
  const { formDraft } = await loaded();
  const draft = formDraft('text', '', { text: 'one' }, 'one');
  draft.follow({ text: 'two' }, 'two');
  expect(draft.value.text).toBe('two');
  draft.value.text = 'mine';
  draft.follow({ text: 'three' }, 'three');
  expect(draft).toMatchObject({ value: { text: 'mine' }, basis: 'two', outdated: true });
  const again = (await loaded()).formDraft('text', '', { text: 'four' }, 'four');
  expect(again).toMatchObject({ value: { text: 'mine' }, basis: 'two', outdated: true });
  again.discard({ text: 'four' }, 'four');
  expect(again).toMatchObject({ value: { text: 'four' }, outdated: false });
});

test('what is painted is kept as a whole', async () => {
  const draft = (await loaded()).paintedDraft('walls', '1', { strokes: [] as number[] }, 'plan');
  draft.value = { strokes: [1, 2] };
  expect((await loaded()).paintedDraft('walls', '1', { strokes: [] as number[] }, 'other')).toMatchObject({ value: { strokes: [1, 2] }, outdated: true });
});

test('a draft that cannot be read, or is of another version, is as none', async () => {
  const key = 'vislam2tag-draft ["/surveys/one","walk","a"]';
  for (const text of ['{', 'null', '{"version":0,"basis":"","value":{"device":"LG"}}']) {
    localStorage.setItem(key, text);
    expect((await loaded()).formDraft('walk', 'a', { device: '' }).changed).toBe(false);
  }
});

test('a browser that stores nothing is noticed', async () => {
  const { formDraft, keeping } = await loaded();
  const refusing = vi.spyOn(Storage.prototype, 'setItem').mockImplementation(() => {
    throw new Error('full');
  });
  formDraft('walk', 'a', { device: '' }).value.device = 'LG';
  await settled();
  expect(keeping.refused).toBe(true);
  refusing.mockRestore();
});
