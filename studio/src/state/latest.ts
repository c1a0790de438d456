// Answers count only while they match what is asked for now.
import { follow } from './data.svelte';

/** Ask, after a pause if one is given, and take the answer. An effect returns what this returns: then only its latest question counts. */
export function latest<T>(ask: () => Promise<T>, take: (answer: T) => void, pause_ms = 0): () => void {
  let wanted = true;
  const begin = () =>
    void follow(async () => {
      try {
        const answer = await ask();
        if (wanted) take(answer);
      } catch (error) {
        if (wanted) throw error;
      }
    });
  const timer = pause_ms ? setTimeout(begin, pause_ms) : begin();
  return () => {
    wanted = false;
    if (timer) clearTimeout(timer);
  };
}
