// Scans and their similarity. A scan is {columns, dbm}: the heard access points, ascending, and their levels.

const FAINTEST_DBM = -105;
const LEAST_LENGTH = 1e-9;
const EXPONENT = 1.7;

export const sum = (values) => values.reduce((total, value) => total + value, 0);
export const largest = (values) => values.reduce((best, value, at) => (value > values[best] ? at : best), 0);

/** A level from 0 (-105 dBm, or less, or not heard) to 1 (0 dBm). */
export function positive(dbm) {
  return Math.min(Math.max(dbm - FAINTEST_DBM, 0), -FAINTEST_DBM) / -FAINTEST_DBM;
}

/** The scans that a model stores. */
export function learnedScans({ start, column, rssi_dbm: dbm }) {
  return Array.from({ length: start.data.length - 1 }, (_, at) => {
    const [from, to] = [start.data[at], start.data[at + 1]];
    return { columns: column.data.subarray(from, to), dbm: dbm.data.subarray(from, to) };
  });
}

/** A scan's levels by column, as a sparse vector. */
export function vector(scan, levelOf) {
  return { columns: scan.columns, values: Array.from(scan.dbm, levelOf) };
}

/** The vector of a scan's levels to the power of 1.7, scaled to length 1. */
export function direction(scan) {
  const { columns, values } = vector(scan, (dbm) => positive(dbm) ** EXPONENT);
  const length = Math.max(Math.sqrt(sum(values.map((value) => value * value))), LEAST_LENGTH);
  return { columns, values: values.map((value) => value / length) };
}

/** The sum, over columns in both vectors, of `shared` of their values (by default their product). */
export function common(one, other, shared = (a, b) => a * b) {
  let total = 0;
  for (let i = 0, j = 0; i < one.columns.length && j < other.columns.length; ) {
    if (one.columns[i] === other.columns[j]) total += shared(one.values[i++], other.values[j++]);
    else if (one.columns[i] < other.columns[j]) i++;
    else j++;
  }
  return total;
}

/** The product of a vector and a row of numbers, one for each access point. */
export function along({ columns, values }, numbers) {
  let total = 0;
  for (let i = 0; i < columns.length; i++) total += values[i] * numbers[columns[i]];
  return total;
}

/** The number of thresholds that each level of a scan exceeds. */
export function steps(scan, thresholds) {
  return vector(scan, (dbm) => thresholds.filter((threshold) => positive(dbm) > threshold).length);
}

/** The cosine of two scans' steps: 1 for each threshold that a level exceeds, 0 for each that it does not. */
export function stepCosine(one, other) {
  const length = Math.sqrt(sum(one.values)) * Math.sqrt(sum(other.values));
  return common(one, other, Math.min) / Math.max(length, LEAST_LENGTH);
}

/** `kernel (m) @ weight (m, t) + mean (t)`, raised to a minimum and scaled to sum 1. */
export function regressedShares(kernel, weight, mean, least, leastSum) {
  const scores = Array.from(mean.data);
  kernel.forEach((value, at) => {
    for (let t = 0; t < scores.length; t++) scores[t] += value * weight.data[at * scores.length + t];
  });
  const cut = scores.map((score) => Math.max(score, least));
  const total = Math.max(sum(cut), leastSum);
  return cut.map((score) => score / total);
}
