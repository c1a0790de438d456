// Landmarks that a correction exchanges: their places in the file stay, what walks saw of them changes.
import type { ControlPoint, Landmark } from '../api/model';
import { data } from './data.svelte';

/** The ids of those that a landmark is exchanged with. */
export function exchangedWith(point: Landmark | ControlPoint): string[] {
  const entry = data.corrections.entries.find(
    ({ table, values }) => table === 'swap_landmarks' && (values.floor ?? point.floor) === point.floor && (values.ids as unknown[]).map(String).includes(point.id),
  );
  return entry ? (entry.values.ids as unknown[]).map(String).filter((id) => id !== point.id) : [];
}
