// `probabilistic`: maps of levels are made of the learned scans; the likeliest cells vote.

import { largest, learnedScans, sum } from "./scans.mjs";
import { voted, withRadii } from "./votes.mjs";

const FAINT_DBM = -88;
const LEAST_HEARD = 0.003;
const MOST_HEARD = 0.995;
const MOST_CELLS = 200;

export function probabilistic({ storeys, parameters, access_points: accessPoints }, arrays) {
  const scans = learnedScans(arrays);
  const average = new Float64Array(accessPoints.length);
  for (const { columns } of scans) for (const column of columns) average[column] += 1 / scans.length;
  const cells = storeys.flatMap((_, storey) => {
    const own = scans.map((_, at) => at).filter((at) => arrays.storey.data[at] === storey);
    return centres(own.map((at) => place(arrays, at)), parameters.cell_m).map((xy) =>
      cell(storey, xy, own, scans, arrays, average, parameters),
    );
  });
  const places = {
    storey: { data: cells.map((one) => one.storey) },
    xy: { data: cells.flatMap((one) => one.xy) },
    z: { data: cells.map((one) => one.z) },
  };
  return (asked) =>
    asked.map((scan) => {
      const log = cells.map((one) => parameters.sharpness * logLikelihood(scan, one, parameters));
      const index = [...log.keys()].sort((i, j) => log[j] - log[i]).slice(0, MOST_CELLS);
      const weight = index.map((at) => Math.exp(log[at] - log[index[0]]));
      return withRadii(voted({ index, weight }, places, storeys.length), arrays.radii.data);
    });
}

function place({ xy }, at) {
  return [xy.data[2 * at], xy.data[2 * at + 1]];
}

/** Centres of the cells that hold a place, and of the eight around each. */
function centres(places, side) {
  const found = new Map();
  for (const [x, y] of places) {
    const [column, line] = [Math.floor(x / side), Math.floor(y / side)];
    for (const i of [-1, 0, 1]) {
      for (const j of [-1, 0, 1]) {
        found.set(`${column + i} ${line + j}`, [(column + i + 0.5) * side, (line + j + 0.5) * side]);
      }
    }
  }
  return [...found.values()];
}

/** How often and how loud each access point is heard in a cell; scans count by their distance from its centre. */
function cell(storey, xy, own, scans, arrays, average, { smoothing_m: smoothing, prior_scans: prior }) {
  const away2 = own.map((at) => (place(arrays, at)[0] - xy[0]) ** 2 + (place(arrays, at)[1] - xy[1]) ** 2);
  const weight = away2.map((one) => Math.exp(-one / (2 * smoothing ** 2)));
  const [count, loud] = [new Float64Array(average.length), new Float64Array(average.length)];
  own.forEach((at, i) => {
    scans[at].columns.forEach((column, j) => {
      count[column] += weight[i];
      loud[column] += weight[i] * scans[at].dbm[j];
    });
  });
  const all = sum(weight) + prior;
  const heard = count.map((one, a) => Math.min(Math.max((one + prior * average[a]) / all, LEAST_HEARD), MOST_HEARD));
  const levelDbm = loud.map((one, a) => (one + prior * FAINT_DBM) / (count[a] + prior));
  const missed = sum(heard.map((one) => Math.log1p(-one)));
  const nearest = own[largest(away2.map((one) => -one))];
  return { storey, xy, z: arrays.z.data[nearest], heard, levelDbm, missed };
}

/** But for a constant of the scan: who is heard, and how loud but for an offset that all its levels share. */
function logLikelihood({ columns, dbm }, { heard, levelDbm, missed }, { noise_db: noise, offset_db: offset }) {
  let [who, total, squares] = [missed, 0, 0];
  columns.forEach((column, i) => {
    const residual = dbm[i] - levelDbm[column];
    who += Math.log(heard[column]) - Math.log1p(-heard[column]);
    total += residual;
    squares += residual ** 2;
  });
  const shared = offset ** 2 / (noise ** 2 + offset ** 2 * columns.length);
  return who - (squares - shared * total ** 2) / (2 * noise ** 2);
}
