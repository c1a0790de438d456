import { describe, expect, it } from 'vitest';
import { type View, hashOf, isStep, viewOf } from './link';

const NOTHING: View = { walk: null, time: 0, tab: null, floor: null, colour: null, shown: null };
const MOMENT: View = { walk: 'floor_1.LG & Co#2', time: 12.3, tab: 'diagnose', floor: -1, colour: 'sigma', shown: ['events', 'walk&able'] };

describe('addresses', () => {
  it.each([NOTHING, MOMENT, { ...MOMENT, shown: [] }, { ...NOTHING, tab: 'radio', floor: 0 }])('lead back to the view that they were made of', (view) => {
    expect(viewOf(hashOf(view))).toEqual(view);
  });
  it('of older pages name a walk and a moment', () => {
    expect(viewOf('#walk=a&t=31.5')).toEqual({ ...NOTHING, walk: 'a', time: 31.5 });
  });
  it('that are broken say nothing', () => {
    expect(viewOf('#walk=a&t=soon&floor=1e9')).toEqual({ ...NOTHING, walk: 'a' });
    expect(viewOf('#kJ3-token_of_entry')).toEqual(NOTHING);
  });
});

describe('one goes back', () => {
  it('over tabs, walks and floors', () => {
    for (const change of [{ tab: 'walks' }, { walk: null }, { floor: 2, time: 0 }]) expect(isStep(MOMENT, { ...MOMENT, ...change })).toBe(true);
  });
  it('not over moments, the floors on the way, layers and colours, and not to a page without a view', () => {
    for (const change of [{ time: 13 }, { floor: 2, time: 13 }, { colour: 'age' }, { shown: null }]) expect(isStep(MOMENT, { ...MOMENT, ...change })).toBe(false);
    expect(isStep(NOTHING, MOMENT)).toBe(false);
  });
});
