// Estimates where scans were taken, from a model's file alone, for use in an app. In a browser, or with Node:
//
//     node locate.mjs building.v2t scans.json > positions.json
//
// Requests and answers are those of `vislam2tag locate --serve` (docs/reference/model-files.md).

import { cellDensity } from "./cell_density.mjs";
import { localKriging } from "./local_kriging.mjs";
import { readModel } from "./model_file.mjs";
import { neighbours } from "./neighbours.mjs";
import { multiCel, regressionNet } from "./networks.mjs";
import { sum } from "./scans.mjs";

/** From a header and arrays to a function from scans with known access points to answers. */
const MODELS = {
  "cell-density": cellDensity,
  "local-kriging": localKriging,
  "multi-cel": multiCel,
  "regression-net": regressionNet,
  "weighted-knn": neighbours,
};

/** Removed models of version 0.2, and their replacements. */
const REMOVED = {
  knn: "use weighted-knn",
  probabilistic: "use weighted-knn",
  "extra-trees": "use weighted-knn",
  combined: "train without --model, which chooses the best model",
  "cell-density-networks": "use cell-density",
};

/** From a model's file (Uint8Array) to a function from `[{scan_id, readings, session}]` to their positions. */
export function openModel(bytes) {
  const { header, arrays } = readModel(bytes);
  refuseRemoved(header);
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

function refuseRemoved({ model, parameters }) {
  if (model in REMOVED) throw new Error(`the model ${model} was removed; ${REMOVED[model]}. Train a new file`);
  if (model === "cell-density" && parameters.networks?.length)
    throw new Error("the parameter networks of cell-density was removed; use cell-density without it. Train a new file");
}

function columnsByName(accessPoints) {
  const lower = accessPoints.map((name, column) => [name.toLowerCase(), column]);
  return new Map([...lower, ...accessPoints.map((name, column) => [name, column])]);
}

/** Levels of the known access points in a scan, by column; several readings of one are averaged. */
function heardBy({ readings, session = "" }, known) {
  const levels = new Map();
  for (const [name, dbm] of Object.entries(readings)) {
    const column = known.get(name) ?? known.get(name.toLowerCase());
    if (column !== undefined) levels.set(column, [...(levels.get(column) ?? []), dbm]);
  }
  const columns = [...levels.keys()].sort((one, other) => one - other);
  return { columns, dbm: columns.map((column) => sum(levels.get(column)) / levels.get(column).length), session };
}

if (typeof process !== "undefined" && process.argv[1]?.endsWith("locate.mjs")) {
  const { readFileSync } = await import("node:fs");
  const [model, scans] = process.argv.slice(2);
  const positions = openModel(readFileSync(model))(JSON.parse(readFileSync(scans, "utf8")).scans);
  console.log(JSON.stringify({ positions }));
}
