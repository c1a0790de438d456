// Outputs that can be compared: labels of this studio, those before the last change, and others.
import { named, t } from '../words/words.svelte';
import { data } from './data.svelte';

/** What an output is called. */
export function outputText(name: string): string {
  const output = data.survey?.outputs.find((each) => each.name === name);
  if (!output) return name === 'before' ? t('output.before') : name;
  return `${named('output', name.replace(/-\d+$/, ''))}: ${output.folder.split('/').at(-1)} (${output.strategy})`;
}
