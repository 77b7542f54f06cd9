// Bytes of rows as numbers with the names of their fields, by the layouts that the simulator printed.

/** A value of a type of WGSL at an offset of some bytes. */
function readValue(live, type, bytes, at) {
  const view = new DataView(bytes.buffer, bytes.byteOffset);
  if (type === "f32") return view.getFloat32(at, true);
  if (type === "u32") return view.getUint32(at, true);
  if (type === "vec2<f32>") return [view.getFloat32(at, true), view.getFloat32(at + 4, true)];
  const array = /^array<(.+), (\d+)>$/.exec(type);
  if (array === null) return readStruct(live, type, bytes, at);
  const [, element, length] = array;
  const size = sizeOf(live, element);
  return Array.from({ length: Number(length) }, (_, index) => readValue(live, element, bytes, at + index * size));
}

/** Bytes of a value of a type of WGSL. */
function sizeOf(live, type) {
  if (type === "f32" || type === "u32") return 4;
  if (type === "vec2<f32>") return 8;
  const array = /^array<(.+), (\d+)>$/.exec(type);
  return array === null ? live.facts.code.structs[type].size : Number(array[2]) * sizeOf(live, array[1]);
}

/** A struct at an offset of some bytes. */
function readStruct(live, name, bytes, at) {
  const { fields } = live.facts.code.structs[name];
  return Object.fromEntries(
    Object.entries(fields).map(([field, { at: offset, type }]) => [field, readValue(live, type, bytes, at + offset)]),
  );
}

/** Writes words into a struct at an offset of a view. */
function writeWords(live, name, view, at, values) {
  const { fields } = live.facts.code.structs[name];
  for (const [field, value] of Object.entries(values)) {
    const { at: offset, type } = fields[field];
    if (type === "f32") view.setFloat32(at + offset, value, true);
    else if (type === "u32") view.setUint32(at + offset, value, true);
    else writeWords(live, type, view, at + offset, value);
  }
}

/** A row of a column: a number, a struct, or an array of floats. */
function readRow(live, column, bytes, at) {
  const { bytes: width, element } = live.facts.code.columns[column];
  if (element === "f32" && width > 4) return new Float32Array(bytes.slice(at, at + width).buffer);
  return width === sizeOf(live, element)
    ? readValue(live, element, bytes, at)
    : readValue(live, `array<${element}, ${width / sizeOf(live, element)}>`, bytes, at);
}
