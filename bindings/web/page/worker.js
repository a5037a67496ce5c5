
// Calibrates the files of one message, then is no longer needed: its memory is free when the page ends it.
self.show = (kind, text) => postMessage({ kind, text });

onmessage = async ({ data: { engine, files, statements } }) => {
  try {
    wasm_bindgen.initSync({ module: engine });
    const recording = new wasm_bindgen.Files();
    for (const file of files) {
      recording.add(file.name, new Uint8Array(await file.arrayBuffer()));
    }
    const outputs = recording.calibrate(statements);
    const copies = outputs.map(({ name, about, bytes }) => ({ name, about, bytes }));
    postMessage({ kind: "done", outputs: copies });
  } catch (error) {
    // The engine's own messages are plain errors; anything else stopped it.
    const kind = error.constructor === Error ? "error" : "crash";
    postMessage({ kind, text: error.message });
  }
};
