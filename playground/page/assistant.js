// The page around the compiler: two workers, one for the text, one for the robot in motion. Names reach the document as text alone.
"use strict";
const byId = (id) => document.getElementById(id);
function node(name, attributes, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) {
    if (key === "text") made.textContent = value;
    else if (key === "class") made.className = value;
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}
const EXAMPLES = JSON.parse(byId("examples").textContent);
const VIEW = byId("view-template");
const saidNumber = (x, digits = 3) => {
  if (!Number.isFinite(x)) return "–";
  const rounded = Number(x.toPrecision(digits));
  const size = Math.abs(rounded);
  const text = size !== 0 && (size >= 1e6 || size < 1e-4) ? rounded.toExponential() : String(rounded);
  return text.replaceAll("-", "−");
};
const thousands = (n) => String(n).replace(/\B(?=(\d{3})+$)/g, " ");

// A worker that answers requests one after the other; `stop` ends what it does.
let compilerModule = null;
let workerAddress = null;
function assistant() {
  let worker = null, next = 0;
  const waiting = new Map();
  const start = () => {
    worker = new Worker(workerAddress);
    worker.onmessage = ({ data: { id, answer } }) => {
      const done = waiting.get(id);
      waiting.delete(id);
      if (done) done(answer);
    };
    worker.onerror = (event) => {
      for (const done of waiting.values()) done({ failure: event.message || "the worker stopped" });
      waiting.clear();
    };
    if (compilerModule) worker.postMessage({ id: next++, name: "start", module: compilerModule });
  };
  return {
    ask: (name, request) => new Promise((done) => {
      if (!worker) start();
      const id = next++;
      waiting.set(id, done);
      worker.postMessage({ id, name, request });
    }),
    stop: (always) => {
      if (!worker || !(always || waiting.size)) return;
      worker.terminate();
      worker = null;
      for (const done of waiting.values()) done(null);
      waiting.clear();
    },
  };
}
const coder = assistant();
const bencher = assistant();

const state = {
  name: "", bytes: null, factors: { masses: {}, lengths: {} }, payload: 0, period: 4, motors: [], motor: 0,
  bench: null, code: null, explained: null, view: null, shape: "", round: 0, module: null, times: {},
};
const files = () => ({ name: state.name, text: byId("robot").value, bytes: state.bytes, scene: byId("scene").value });
function say(text, isBad) {
  byId("status").textContent = text;
  byId("status").className = isBad ? "bad" : "";
}
