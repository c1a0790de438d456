// The file that `vislam2tag train` writes: safetensors, with the model's header as JSON in its only metadata entry.

const NEWEST_FORMAT = 1;
const KINDS = { F64: Float64Array, F32: Float32Array, I64: BigInt64Array, I32: Int32Array, BOOL: Uint8Array };

/** From the file's bytes (a Uint8Array) to its header and its arrays by name: `{shape, data}`, row after row. */
export function readModel(bytes) {
  const begun = Number(new DataView(bytes.buffer, bytes.byteOffset).getBigUint64(0, true)) + 8;
  const { __metadata__: metadata, ...entries } = JSON.parse(new TextDecoder().decode(bytes.subarray(8, begun)));
  const header = JSON.parse(metadata.vislam2tag_model);
  if (header.format_version > NEWEST_FORMAT) throw new Error(`format version ${header.format_version}: update`);
  const arrays = {};
  for (const [name, { dtype, shape, data_offsets: [from, to] }] of Object.entries(entries)) {
    const at = bytes.byteOffset + begun;
    const numbers = new KINDS[dtype](bytes.buffer.slice(at + from, at + to));
    arrays[name] = { shape, data: dtype === "I64" ? Float64Array.from(numbers, Number) : numbers };
  }
  return { header, arrays };
}

/** Row `index` of an array of two axes. */
export function row({ shape, data }, index) {
  return data.subarray(index * shape[1], (index + 1) * shape[1]);
}

/** The rows of an array of two axes. */
export function rows(array) {
  return Array.from({ length: array.shape[0] }, (_, index) => row(array, index));
}
