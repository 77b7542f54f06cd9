// Runs in a worker of the page, which baker.js starts: the simulator as WebAssembly bakes what is asked for, once.

onmessage = async ({ data: { module, asked, bytes } }) => {
  let exports;
  const result = () => new Uint8Array(exports.memory.buffer, exports.result() >>> 0, exports.result_length()).slice();
  try {
    ({ exports } = await WebAssembly.instantiate(module, {}));
    const line = new TextEncoder().encode(`${JSON.stringify(asked)}\n`);
    const room = exports.room(line.length + bytes.length) >>> 0, memory = new Uint8Array(exports.memory.buffer);
    memory.set(line, room);
    memory.set(bytes, room + line.length);
    const isBaked = exports.bake() !== 0;
    postMessage({ isBaked, result: result() });
  } catch (error) {
    // A panic has left its text.
    const text = exports === undefined ? "" : new TextDecoder().decode(result());
    postMessage({ isBaked: false, failure: `${error.message}; ${text}` });
  }
};
