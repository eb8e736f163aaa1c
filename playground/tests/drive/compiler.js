// The page's worker without a page: `node compiler.js WORKER.js COMPILER.wasm` reads a request per line, [name, request], and writes an answer per line with
// the milliseconds that it took.
"use strict";
const fs = require("fs");
const readline = require("readline");
const [workerFile, moduleFile] = process.argv.slice(2);
let answered = null;
globalThis.postMessage = (message) => answered(message.answer);
(0, eval)(fs.readFileSync(workerFile, "utf8"));
const ask = (name, request, module) => new Promise((done) => {
  answered = done;
  globalThis.onmessage({ data: { id: 0, name, request, module } });
});
(async () => {
  await ask("start", null, new WebAssembly.Module(fs.readFileSync(moduleFile)));
  for await (const line of readline.createInterface({ input: process.stdin })) {
    const [name, request] = JSON.parse(line);
    const began = performance.now();
    const answer = await ask(name, request);
    const plain = (_, value) => (ArrayBuffer.isView(value) ? Array.from(value) : value);
    console.log(JSON.stringify({ answer, milliseconds: performance.now() - began }, plain));
  }
})();
