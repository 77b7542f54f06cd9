// The data blocks of a page: texts, and bytes as gzip in base64.

/** The text of a data block. */
const block = (id) => byId(id).textContent.trim();

/** The bytes of a base64 text that holds a gzip file. */
async function inflated(text) {
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const { readable, writable } = new DecompressionStream("gzip");
  const writer = writable.getWriter();
  // The reading end reports an error in the bytes.
  const written = writer.write(packed).then(() => writer.close()).catch(() => {});
  const [bytes] = await Promise.all([new Response(readable).arrayBuffer(), written]);
  return new Uint8Array(bytes);
}
