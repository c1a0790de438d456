// `extra-trees`: each tree leads to a leaf, whose learned scan votes.

import { positive } from "./scans.mjs";
import { voted, withRadii } from "./votes.mjs";

const LEAF = -1;

export function trees({ storeys, access_points: accessPoints }, arrays) {
  const [root, feature, threshold, left, right, scan] = ["root", "feature", "threshold", "left", "right", "scan"].map(
    (name) => arrays[name].data,
  );
  return (asked) =>
    asked.map(({ columns, dbm }) => {
      const level = new Float32Array(accessPoints.length);
      columns.forEach((column, i) => (level[column] = positive(dbm[i])));
      const index = Array.from(root, (node) => {
        while (feature[node] !== LEAF) node = level[feature[node]] <= threshold[node] ? left[node] : right[node];
        return scan[node];
      });
      return withRadii(voted({ index, weight: index.map(() => 1) }, arrays, storeys.length), arrays.radii.data);
    });
}
