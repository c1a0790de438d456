import { describe, expect, it } from 'vitest';
import { hashOf, momentOf } from './link';

describe('links to a moment', () => {
  it('lead back to the walk and time that they were made of', () => {
    const walk = 'floor_1.LG & Co#2';
    expect(momentOf(hashOf(walk, 12.34))).toEqual({ walk, time: 12.3 });
  });
  it('tell a token and broken times from a moment', () => {
    expect(momentOf('#kJ3-token_of_entry')).toBeNull();
    expect(momentOf('#walk=a&t=soon')).toEqual({ walk: 'a', time: 0 });
  });
});
