// What people do: compile, open, save.
async function compile() {
  state.round++;
  const round = state.round;
  coder.stop();
  Object.assign(state, { code: null, explained: null, factors: { masses: {}, lengths: {} }, payload: 0, motors: [], times: { began: performance.now() } });
  delete document.body.dataset.done;
  say("Compiling …");
  byId("compile").disabled = false;
  showWaterfall();
  byId("waterfall-about").textContent = "";
  bench_again();
  for (const quick of [true, false]) {
    const began = performance.now();
    const answer = await coder.ask("compile", { ...files(), quick });
    if (!answer || round !== state.round) return;
    if (answer.failure) {
      showComplaints([], answer.failure);
      say("The compiler stopped.", true);
      return finished(round);
    }
    showComplaints(answer.complaints);
    if (answer.text === null) {
      for (const id of ["moving", "limits-box", "sliders-box", "counts-box", "code-box"]) byId(id).hidden = true;
      if (state.view) state.view.stop();
      Object.assign(state, { view: null, shape: "" });
      byId("viewed").replaceChildren();
      say("There are errors: no code.", true);
      return finished(round);
    }
    state.code = { ...answer, quick, milliseconds: performance.now() - began };
    if (state.times.first === undefined) state.times.first = performance.now() - state.times.began;
    say(quick ? `First code after ${saidNumber(state.times.first / 1000)} s; looking for fewer operations …` : `Done in ${saidNumber((performance.now() - state.times.began) / 1000)} s.`);
    showCounts();
    showCode();
  }
  finished(round);
}
function finished(round) {
  if (round !== state.round) return;
  state.done = round;
  settle();
}
function settle() {
  if (benching || state.done !== state.round) return;
  // for whoever waits, people aside
  document.body.dataset.done = JSON.stringify({ first: state.times.first, moving: state.times.moving, all: performance.now() - state.times.began });
}
async function explain() {
  const round = state.round;
  byId("explain").disabled = true;
  byId("waterfall-about").textContent = "Compiling with one optimisation more at a time …";
  const answer = await coder.ask("compile", { ...files(), explained: true });
  byId("explain").disabled = false;
  if (!answer || round !== state.round) return;
  if (answer.failure || !answer.report) {
    byId("waterfall-about").textContent = answer.failure || "There is no report.";
    return;
  }
  state.explained = answer.report;
  showWaterfall();
  document.body.dataset.explained = "yes";
}

function open(name, text, bytes) {
  state.name = name;
  state.bytes = bytes || null;
  byId("robot").value = text;
  byId("robot-name").textContent = name;
  state.motor = 0;
  compile();
}
async function openFile(file) {
  if (file.size > 64 << 20) return say("That file has more than 64 MiB.", true);
  const bytes = new Uint8Array(await file.arrayBuffer());
  try {
    open(file.name, new TextDecoder("utf-8", { fatal: true }).decode(bytes));
  } catch {
    // the compiler says where it stops being text
    let raw = "";
    for (let k = 0; k < bytes.length; k += 8192) raw += String.fromCharCode(...bytes.subarray(k, k + 8192));
    open(file.name, new TextDecoder().decode(bytes), btoa(raw));
  }
}
function save(name, parts, type) {
  const address = URL.createObjectURL(new Blob(parts, { type }));
  const link = node("a", { href: address, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}
const stem = () => state.name.replace(/\.[^.]*$/, "").replace(/[^A-Za-z0-9_-]/g, "_") || "robot";

function listen() {
  let typing = 0;
  for (const id of ["robot", "scene"]) {
    byId(id).addEventListener("input", () => {
      if (id === "robot") state.bytes = null;
      clearTimeout(typing);
      typing = setTimeout(compile, 700);
    });
    byId(id).addEventListener("keydown", (event) => {
      if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) {
        clearTimeout(typing);
        compile();
        event.preventDefault();
      }
    });
  }
  byId("compile").addEventListener("click", compile);
  byId("example").addEventListener("change", () => {
    const name = byId("example").value;
    open(name, EXAMPLES[name]);
  });
  byId("file").addEventListener("change", () => byId("file").files[0] && openFile(byId("file").files[0]));
  const drop = byId("given");
  for (const name of ["dragenter", "dragover"]) drop.addEventListener(name, (event) => {
    event.preventDefault();
    byId("drop").classList.add("over");
  });
  for (const name of ["dragleave", "drop"]) drop.addEventListener(name, () => byId("drop").classList.remove("over"));
  drop.addEventListener("drop", (event) => {
    event.preventDefault();
    if (event.dataTransfer.files[0]) openFile(event.dataTransfer.files[0]);
  });
  byId("reset").addEventListener("click", compile);
  byId("take").addEventListener("click", async () => {
    const { factors, payload, period, motors, round } = state;
    const bench = await bencher.ask("bench", { ...files(), factors, payload, period, motors, whole: true });
    if (!bench || !bench.text || round !== state.round) return;
    state.bytes = null;
    byId("robot").value = bench.text;
    byId("scene").value = bench.scene;
    byId("scene-box").open = true;
    compile();
  });
  byId("explain").addEventListener("click", explain);
  byId("waterfall-function").addEventListener("change", showWaterfall);
  byId("copy").addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(state.code.text);
      byId("code-about").textContent = "Copied.";
    } catch {
      byId("code-about").textContent = "The browser does not let this page copy: save the file instead.";
    }
  });
  byId("save-code").addEventListener("click", () => state.code && save(`${stem()}.rs`, [state.code.text], "text/plain"));
  byId("save-robot").addEventListener("click", () => state.bench && save(state.name, [state.bench.text], "text/plain"));
  byId("save-module").addEventListener("click", () => {
    if (!state.module) return;
    save(`${stem()}.wasm`, [Uint8Array.from(atob(state.module), (c) => c.charCodeAt(0))], "application/wasm");
  });
}

async function begin() {
  listen();
  byId("example").append(...Object.keys(EXAMPLES).map((name) => node("option", { value: name, text: name })));
  say("Unpacking the compiler …");
  try {
    const raw = atob(byId("compiler").textContent);
    const size = Number(byId("compiler").dataset.size);
    byId("compiler").remove();
    const packed = new Uint8Array(raw.length);
    for (let k = 0; k < raw.length; k++) packed[k] = raw.charCodeAt(k);
    workerAddress = URL.createObjectURL(new Blob([byId("worker").textContent], { type: "text/javascript" }));
    const { module, failure } = await bencher.ask("unpack", { packed, size });
    if (failure) throw new Error(failure);
    compilerModule = module;
    bencher.stop(true);
  } catch (error) {
    return say(`This browser cannot run the compiler: ${error.message}`, true);
  }
  byId("version").textContent = `straightline ${await bencher.ask("version", null)}`;
  const asked = new URLSearchParams(location.hash.slice(1)).get("robot");
  const first = asked in EXAMPLES ? asked : "ur5.urdf";
  byId("example").value = first;
  document.body.dataset.ready = String(performance.now());
  open(first, EXAMPLES[first]);
}
begin();
