// `multi-cel` and `regression-net`: dense layers and the decoding of their outputs.

import { rows } from "./model_file.mjs";
import { largest, sum } from "./scans.mjs";
import { withRadii } from "./votes.mjs";

const FLOOR_DEVIATION = 0.5;

export function softmax(logs) {
  const most = logs.reduce((one, other) => Math.max(one, other), -Infinity);
  const shares = Array.from(logs, (log) => Math.exp(log - most));
  const total = sum(shares);
  return shares.map((share) => share / total);
}

const relu = (values) => values.map((value) => Math.max(value, 0));

/** Outputs of layers, each `weight (outputs, inputs) @ inputs + bias`, with ReLU between them. */
function dense(layers, inputs) {
  return layers.reduce((hidden, { weight, bias }, at) => {
    const values = rows(weight).map((line, o) => line.reduce((total, one, i) => total + one * hidden[i], bias[o]));
    return at < layers.length - 1 ? relu(values) : values;
  }, inputs);
}

/** The layers with this prefix, in order. */
function layersOf(arrays, name) {
  const found = Object.keys(arrays).filter((key) => key.startsWith(name) && key.endsWith(".weight"));
  const number = (key) => Number(key.slice(name.length).split(".")[0]);
  return found
    .sort((one, other) => number(one) - number(other))
    .map((key) => ({ weight: arrays[key], bias: arrays[key.replace(/weight$/, "bias")].data }));
}

/** Levels from 0 (not heard) to 1, one for each access point. */
function inputsOf({ columns, dbm }, width, arrays) {
  const [faintest, strongest, exponent] = ["faintest_dbm", "strongest_dbm", "exponent"].map(
    (name) => arrays[`scaling.${name}`].data[0],
  );
  const inputs = new Float64Array(width);
  columns.forEach((column, i) => {
    const share = (dbm[i] - faintest) / (strongest - faintest);
    inputs[column] = Math.min(Math.max(share, 0), 1) ** exponent;
  });
  return inputs;
}

function network(answer) {
  return ({ access_points: accessPoints }, arrays) => {
    const answerTo = answer(arrays);
    return (asked) =>
      asked.map((scan) => {
        const found = answerTo(inputsOf(scan, accessPoints.length, arrays));
        return withRadii({ ...found, z: arrays.height_m.data[found.storey] }, arrays.radii.data);
      });
  };
}

/** The place is decoded from the most likely cell's code; the floor is that of the cell. */
export const multiCel = network((arrays) => {
  const [backbone, classes, codes] = ["backbone", "class_head", "code_head"].map((part) =>
    layersOf(arrays, `network.${part}.`),
  );
  const [reach] = arrays.reach_m.data;
  const centres = rows(arrays.centre_m);
  const storeys = rows(arrays.on_storey);
  return (inputs) => {
    const hidden = backbone.length ? relu(dense(backbone, inputs)) : inputs;
    const share = softmax(dense(classes, hidden));
    const code = dense(codes, hidden).map(Math.tanh);
    const places = centres.map(([x, y], c) => [x + reach * code[2 * c], y + reach * code[2 * c + 1]]);
    const best = largest(share);
    const [x, y] = places[best];
    const spread = Math.sqrt(sum(places.map((at, c) => share[c] * ((at[0] - x) ** 2 + (at[1] - y) ** 2))));
    const probability = Array.from(storeys[0], (_, s) => sum(share.map((one, c) => one * storeys[c][s])));
    return { storey: largest(storeys[best]), probability, x, y, spread };
  };
});

/** Three numbers are x, y and the floor, further ones the building; the storey is the closest one in training. */
export const regressionNet = network((arrays) => {
  const layers = layersOf(arrays, "network.");
  const { floor, taught, mean, deviation, in_building: inBuilding } = arrays;
  return (inputs) => {
    const found = dense(layers, inputs);
    const [x, y, level] = [0, 1, 2].map((at) => found[at] * deviation.data[at] + mean.data[at]);
    const buildings = inBuilding.shape[1];
    const building = largest(found.slice(3));
    const closeness = Array.from(floor.data, (number, s) => {
      const here = taught.data[s] > 0 && (!buildings || inBuilding.data[s * buildings + building] > 0);
      return here ? -0.5 * ((number - level) / FLOOR_DEVIATION) ** 2 : -Infinity;
    });
    return { storey: largest(closeness), probability: softmax(closeness), x, y, spread: 0 };
  };
});
