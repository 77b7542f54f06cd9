// Files that are dropped on the page or chosen: a policy drives the crowd, a world file is a benchmark more.

/** Files that are something else, by the end of their names, and what would do. */
const NOT_HERE = [
  [/\.(toml|xodr|osm|net\.xml)$/i, "describes a road or a benchmark; `offtrack web --world` makes a world file of it"],
  [/\.(pt|pth|onnx|zip|npz|h5)$/i, "is a network of another program; `offtrack` writes policies as .safetensors"],
];

/** Whether a file begins as a world file does, of any version. */
function isWorldFile(live, bytes) {
  const [word] = live.facts.world_file.split(" ");
  return new TextDecoder().decode(bytes.subarray(0, word.length)) === word;
}

/** Takes a file: a promise of what to say. The errors of those that read it are sentences. */
async function takeFile(app, name, bytes) {
  const other = NOT_HERE.find(([ending]) => ending.test(name));
  if (other) throw new Error(`${name} ${other[1]}.`);
  if (bytes.length === 0) throw new Error(`${name} is empty.`);
  if (isWorldFile(app.live, bytes)) {
    const index = await app.live.addWorld(name, bytes);
    const { worlds } = app.live.facts;
    worlds[index].file = name;
    tellApart(worlds.slice(0, index), worlds[index]);
    try {
      await app.choose({ world: index });
    } catch (error) {
      app.forgetWorld(index);
      throw error;
    }
    return `Trucks drive on ${name} now.`;
  }
  const policy = policyOf(app.live, name, bytes);
  const fits = await app.worldFor(policy);
  await app.addPolicy(policy, fits);
  return `${name} drives now, on ${worldWords(app.live.facts.worlds[fits])}.`;
}

/** A policy file's policy. What is wrong with it is said of the file. */
function policyOf(live, name, bytes) {
  try {
    return Policy.read(live, name, bytes);
  } catch (error) {
    throw new Error(`${name} ${error.message}.`);
  }
}

/** Listens to drags over the page and to the file dialogue. */
function listenToFiles(app) {
  const hint = byId("drop-here");
  const taken = async (file) => {
    let bytes;
    try {
      bytes = new Uint8Array(await file.arrayBuffer());
    } catch {
      return app.say(`${file.name} cannot be read.`, true);
    }
    return app.dropFile(file.name, bytes);
  };
  let depth = 0;
  const show = (more) => {
    depth = Math.max(depth + more, 0);
    hint.hidden = depth === 0;
  };
  const hasFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
  window.addEventListener("dragenter", (event) => hasFiles(event) && show(1));
  window.addEventListener("dragleave", (event) => hasFiles(event) && show(-1));
  window.addEventListener("dragover", (event) => {
    // Otherwise the browser would open the file instead.
    if (hasFiles(event)) event.preventDefault();
  });
  window.addEventListener("drop", async (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    depth = 0;
    show(0);
    for (const file of event.dataTransfer.files) await taken(file);
  });
  byId("open-file").addEventListener("click", () => byId("file").click());
  byId("file").addEventListener("change", async () => {
    const [file] = byId("file").files;
    if (file) await taken(file);
    byId("file").value = "";
  });
}
