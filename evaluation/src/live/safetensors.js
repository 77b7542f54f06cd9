// Policy files: safetensors with a description and a checksum in its metadata. What is wrong with one is said in words.

/** The header and the tensors' bytes of a safetensors file. */
function readTensors(bytes) {
  const damaged = (words) => new Error(`is not a policy file, or is damaged: ${words}`);
  if (bytes.length < 8) throw damaged("it is too short");
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const size = Number(view.getBigUint64(0, true));
  if (bytes.length - 8 < size) throw damaged("its header is longer than the file");
  let header;
  try {
    header = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes.subarray(8, 8 + size)));
  } catch {
    throw damaged("its header is no JSON");
  }
  const tensor = (name) => {
    const { dtype, shape, data_offsets: [from, to] = [] } = header?.[name] ?? {};
    if (dtype === undefined) throw damaged(`it has no ${name}`);
    if (dtype !== "F32") throw damaged(`${name} must hold 32-bit floats`);
    const length = shape.reduce((product, side) => product * side, 1);
    if (!(0 <= from && to <= bytes.length - 8 - size && to - from === 4 * length))
      throw damaged(`${name} does not lie in the file`);
    return { name, shape, bytes: bytes.slice(8 + size + from, 8 + size + to) };
  };
  return { metadata: header?.__metadata__ ?? {}, tensor };
}

/** CRC-32 of several arrays of bytes, one after the other. */
function checksumOf(parts) {
  const table = Uint32Array.from({ length: 256 }, (_, byte) => {
    let rest = byte;
    for (let bit = 0; bit < 8; bit++) rest = rest & 1 ? 0xedb88320 ^ (rest >>> 1) : rest >>> 1;
    return rest;
  });
  let rest = 0xffffffff;
  for (const part of parts) for (const byte of part) rest = table[(rest ^ byte) & 0xff] ^ (rest >>> 8);
  return (rest ^ 0xffffffff) >>> 0;
}

/** A description's text with a 0 as its checksum, and otherwise as it was written. */
const unsigned = (text) => text.replace(/("checksum"\s*:\s*)\d+/, "$10");
