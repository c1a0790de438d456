// Where scans were taken, by a model's file alone: what an app embeds. In a browser, or by Node:
//
//     node locate.mjs building.v2t scans.json > positions.json
//
// Question and answer are those of `vislam2tag locate --serve` (docs/reference/model-files.md).

import { cellDensity } from "./cell_density.mjs";
import { localKriging } from "./local_kriging.mjs";
import { readModel } from "./model_file.mjs";
import { neighbours } from "./neighbours.mjs";
import { multiCel, regressionNet } from "./networks.mjs";
import { probabilistic } from "./probabilistic.mjs";
import { largest, sum } from "./scans.mjs";
import { trees } from "./trees.mjs";

/** From a header and arrays to a function from scans that hear something known to answers. */
const MODELS = {
  "cell-density": cellDensity,
  "cell-density-networks": cellDensity,
  combined,
  "extra-trees": trees,
  knn: neighbours,
  "local-kriging": localKriging,
  "multi-cel": multiCel,
  probabilistic,
  "regression-net": regressionNet,
  "weighted-knn": neighbours,
};

/** From a model's file (Uint8Array) to a function from `[{scan_id, readings, session}]` to their positions. */
export function openModel(bytes) {
  const { header, arrays } = readModel(bytes);
  const answer = MODELS[header.model](header, arrays);
  const known = columnsByName(header.access_points);
  return (scans) => {
    const heard = scans.map((scan) => heardBy(scan, known));
    const some = [...heard.keys()].filter((at) => heard[at].columns.length);
    const positions = scans.map(({ scan_id: scanId }) => ({ scan_id: scanId, status: "unknown" }));
    answer(some.map((at) => heard[at])).forEach((found, i) => {
      const [building, floor] = header.storeys[found.storey];
      Object.assign(positions[some[i]], {
        status: found.unlike ? "unlike" : "ok",
        building: building || null,
        floor,
        x: found.x,
        y: found.y,
        z: Number.isNaN(found.z) ? null : found.z,
        radius_68_m: found.radius68,
        radius_95_m: found.radius95,
        floor_probability: found.probability[found.storey],
      });
    });
    return positions;
  };
}

function columnsByName(accessPoints) {
  const lower = accessPoints.map((name, column) => [name.toLowerCase(), column]);
  return new Map([...lower, ...accessPoints.map((name, column) => [name, column])]);
}

/** What a scan heard of the known access points, by column; of several readings of one the mean. */
function heardBy({ readings, session = "" }, known) {
  const levels = new Map();
  for (const [name, dbm] of Object.entries(readings)) {
    const column = known.get(name) ?? known.get(name.toLowerCase());
    if (column !== undefined) levels.set(column, [...(levels.get(column) ?? []), dbm]);
  }
  const columns = [...levels.keys()].sort((one, other) => one - other);
  return { columns, dbm: columns.map((column) => sum(levels.get(column)) / levels.get(column).length), session };
}

/** `combined`: the storey that its parts find likeliest on average, and the mean of those that chose it. */
function combined(header, arrays) {
  const { models, settings } = header.parameters;
  if (settings?.length !== models.length) throw new Error("the file does not hold its parts' settings: train again");
  const parts = models.map((model, number) => {
    const own = Object.entries(arrays).filter(([name]) => name.startsWith(`${number}.`));
    const named = Object.fromEntries(own.map(([name, array]) => [name.slice(`${number}.`.length), array]));
    return MODELS[model]({ ...header, model, parameters: settings[number] }, named);
  });
  return (scans) => {
    const all = parts.map((part) => part(scans));
    return scans.map((_, at) => meanAnswer(all.map((answers) => answers[at])));
  };
}

function meanAnswer(found) {
  const mean = (some, valueOf) => sum(some.map(valueOf)) / some.length;
  const probability = found[0].probability.map((_, s) => mean(found, (one) => one.probability[s]));
  const storey = largest(probability);
  const agreed = found.filter((one) => one.storey === storey);
  const some = agreed.length ? agreed : found;
  const names = ["x", "y", "z", "radius68", "radius95"];
  const numbers = Object.fromEntries(names.map((name) => [name, mean(some, (one) => one[name])]));
  return { storey, probability, ...numbers, unlike: found.some((one) => one.unlike) };
}

if (typeof process !== "undefined" && process.argv[1]?.endsWith("locate.mjs")) {
  const { readFileSync } = await import("node:fs");
  const [model, scans] = process.argv.slice(2);
  const positions = openModel(readFileSync(model))(JSON.parse(readFileSync(scans, "utf8")).scans);
  console.log(JSON.stringify({ positions }));
}
