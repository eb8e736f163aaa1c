// Chromium on the page, by the browser's own protocol over a pipe: `node browser.js CHROMIUM PAGE SCENARIO FOLDER`, which writes what was seen as one line
// of JSON. Keys are pressed as a keyboard does.
"use strict";
const { spawn } = require("child_process");
const fs = require("fs");
const path = require("path");
const [chromium, page, scenario, folder] = process.argv.slice(2);
fs.mkdirSync(folder, { recursive: true });

const browser = spawn(chromium, [
  "--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars", "--no-first-run",
  "--disable-background-networking", "--disable-component-update", "--disable-extensions", "--remote-debugging-pipe", `--user-data-dir=${path.join(folder, "profile")}`,
], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
let next = 1;
const waiting = new Map();
const said = [];
const requests = [];
let buffer = "";
browser.stdio[4].on("data", (bytes) => {
  buffer += bytes;
  for (let end = buffer.indexOf("\0"); end >= 0; end = buffer.indexOf("\0")) {
    const message = JSON.parse(buffer.slice(0, end));
    buffer = buffer.slice(end + 1);
    if (message.id) {
      const { done, failed } = waiting.get(message.id);
      if (message.error) failed(new Error(JSON.stringify(message.error)));
      else done(message.result);
    } else if (message.method === "Runtime.consoleAPICalled") said.push(message.params.args.map((a) => a.value || a.description).join(" "));
    else if (message.method === "Runtime.exceptionThrown") said.push(message.params.exceptionDetails.exception?.description || message.params.exceptionDetails.text);
    else if (message.method === "Log.entryAdded") said.push(`${message.params.entry.text} ${message.params.entry.url || ""}`);
    else if (message.method === "Network.requestWillBeSent") requests.push(message.params.request.url);
  }
});
let session;
function send(method, params = {}) {
  const id = next++;
  browser.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId: session })}\0`);
  return new Promise((done, failed) => waiting.set(id, { done, failed }));
}
async function seen(expression) {
  const { result, exceptionDetails } = await send("Runtime.evaluate", { expression, returnByValue: true, awaitPromise: true });
  if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description || exceptionDetails.text}`);
  return result.value;
}
const pause = (ms) => new Promise((done) => setTimeout(done, ms));
async function until(expression, seconds = Number(process.env.SECONDS || 300)) {
  const end = Date.now() + seconds * 1000;
  while (Date.now() < end) {
    const value = await seen(expression);
    if (value) return value;
    await pause(100);
  }
  throw new Error(`not within ${seconds} s: ${expression}; said ${JSON.stringify(said)}; status ${await seen("document.getElementById('status').textContent")}`);
}
const done = () => until("document.body.dataset.done");
async function key(name, { text, code, keyCode, modifiers } = {}) {
  const event = { key: name, code: code || name, windowsVirtualKeyCode: keyCode || 0, modifiers: modifiers || 0 };
  await send("Input.dispatchKeyEvent", { ...event, type: "keyDown", text });
  await send("Input.dispatchKeyEvent", { ...event, type: "keyUp" });
}
const press = {
  tab: () => key("Tab", { keyCode: 9 }), enter: () => key("Enter", { keyCode: 13, text: "\r" }), down: () => key("ArrowDown", { keyCode: 40 }),
  right: () => key("ArrowRight", { keyCode: 39 }), compile: () => key("Enter", { keyCode: 13, modifiers: 2 }), all: () => key("a", { keyCode: 65, code: "KeyA", modifiers: 2 }),
};
async function tabTo(id) {
  for (let k = 0; k < 200; k++) {
    if (await seen("document.activeElement.id") === id) return k;
    await press.tab();
  }
  throw new Error(`no Tab leads to ${id}`);
}
async function picture(name, whole) {
  const height = whole ? Math.min(12000, await seen("document.documentElement.scrollHeight")) : undefined;
  const width = await seen("innerWidth");
  const clip = whole ? { x: 0, y: 0, width, height, scale: 1 } : undefined;
  const { data } = await send("Page.captureScreenshot", { format: "png", captureBeyondViewport: !!whole, clip });
  fs.writeFileSync(path.join(folder, `${name}.png`), Buffer.from(data, "base64"));
}
async function opened(fragment, { width = 1280, height = 900, dark = false } = {}) {
  await send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: false });
  await send("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }, { name: "prefers-reduced-motion", value: "reduce" }] });
  await send("Page.navigate", { url: "about:blank" });
  await send("Page.navigate", { url: `file://${page}#${fragment}` });
  await until("document.readyState === 'complete'");
}
// Text into the robot's field as a person types or pastes it.
async function typed(text) {
  await seen("document.getElementById('robot').focus()");
  await press.all();
  await seen("delete document.body.dataset.done");
  await send("Input.insertText", { text });
}
const FACTS = `({
  status: document.getElementById("status").textContent, title: document.title,
  done: JSON.parse(document.body.dataset.done || "null"), code: document.getElementById("code").textContent.length,
  counts: document.querySelectorAll("#counts tbody tr").length, limits: document.querySelectorAll("#limits tbody tr").length,
  sliders: document.querySelectorAll("#sliders input").length, complaints: [...document.querySelectorAll("#complaints pre")].map((p) => p.textContent),
  about: document.getElementById("moving-about").textContent, summary: document.getElementById("limits-summary").textContent,
  vertices: Number(document.getElementById("picture")?.dataset.vertices || 0), problem: document.getElementById("picture")?.dataset.problem || null,
  unnamed: [...document.querySelectorAll("button, input, select, textarea, [role=application], [role=region]")].filter((e) => !e.closest("details:not([open])") && !(e.textContent.trim() && e.tagName === "BUTTON") && !e.labels?.length && !e.getAttribute("aria-label") && !e.getAttribute("aria-labelledby")).map((e) => e.outerHTML.slice(0, 120)),
  markup: document.querySelectorAll("img, iframe, object, embed, link, body b").length, scripts: document.scripts.length,
})`;

const SCENARIOS = {
  // the page as it opens, and its pictures
  async first() {
    await opened("robot=ur5.urdf&t=1");
    await done();
    const facts = await seen(FACTS);
    await picture("light", true);
    await seen("document.getElementById('explain').click()");
    await until("document.body.dataset.explained");
    facts.waterfall = await seen("document.querySelectorAll('#waterfall tbody tr').length");
    facts.waterfallAbout = await seen("document.getElementById('waterfall-about').textContent");
    await picture("waterfall", true);
    await opened("robot=panda.urdf&t=1", { dark: true });
    await done();
    await picture("dark", true);
    await opened("robot=planar_2r.toml&t=1", { width: 420, height: 900 });
    await done();
    facts.narrow = await seen("document.documentElement.scrollWidth");
    await picture("narrow", true);
    await opened("robot=hyq.urdf&t=1", { width: 420, height: 900, dark: true });
    await done();
    await picture("narrow-dark", true);
    return facts;
  },
  // everything by keys
  async keyboard() {
    await opened("robot=planar_2r.toml&t=1");
    await done();
    const steps = {};
    await seen("document.body.focus()");
    steps.example = await tabTo("example");
    await seen("delete document.body.dataset.done");
    await press.down();
    await until("document.getElementById('robot-name').textContent !== 'planar_2r.toml' && document.body.dataset.done");
    steps.chosen = await seen("document.getElementById('robot-name').textContent");
    steps.robot = await tabTo("robot");
    await press.all();
    await seen("delete document.body.dataset.done");
    await send("Input.insertText", { text: "[robot]\nname = 3\n" });
    await press.compile();
    await until("!document.getElementById('complaints-box').hidden && document.body.dataset.done");
    steps.complaint = await seen("document.querySelector('#complaints pre').textContent");
    await seen("document.querySelector('#complaints button').focus()");
    await press.enter();
    steps.selected = await seen("(({ value, selectionStart, selectionEnd }) => [value.slice(0, selectionStart).split('\\n').length, document.activeElement.id, selectionEnd > selectionStart])(document.getElementById('robot'))");
    await seen("document.getElementById('example').focus()");
    await seen("delete document.body.dataset.done");
    await press.down();
    await done();
    const slider = "[...document.querySelectorAll('#sliders input')]";
    const first = await seen(`${slider}.find((s) => s.labels[0].textContent.startsWith('Payload')).id`);
    await tabTo(first);
    const before = await seen("[document.getElementById('limits').textContent, document.body.dataset.bench]");
    for (let k = 0; k < 20; k++) await press.right();
    await until(`document.getElementById('limits').textContent !== ${JSON.stringify(before[0])}`);
    steps.payload = await seen(`document.getElementById('${first}').getAttribute('aria-valuetext')`);
    steps.outline = await seen("getComputedStyle(document.activeElement).outlineStyle");
    return { ...(await seen(FACTS)), steps };
  },
  // sliders: what they change, and that the file's numbers come back
  async sliders() {
    await opened("robot=ur5.urdf&t=1");
    await done();
    const limits = () => seen("[...document.querySelectorAll('#limits tbody tr')].map((row) => [...row.children].map((cell) => cell.textContent))");
    const found = { before: await limits() };
    const move = async (label, by) => {
      const count = await seen("document.body.dataset.bench");
      await seen(`(() => { const input = [...document.querySelectorAll('#sliders input')].find((s) => s.labels[0].textContent === ${JSON.stringify(label)});
        input.value = Number(input.value) + ${by}; input.dispatchEvent(new Event('input', { bubbles: true })); })()`);
      const began = Date.now();
      await until(`document.body.dataset.bench !== '${count}' `);
      await pause(400);
      return Date.now() - began - 400;
    };
    found.massTime = await move("forearm_link", "Math.log(2)");
    found.heavier = await limits();
    found.lengthTime = await move("elbow_joint", "Math.log(1.3)");
    found.longer = await limits();
    found.motorTime = await move("Resistance of the winding", "Math.log(2)");
    found.hotter = await limits();
    found.milliseconds = await seen("state.bench.milliseconds");
    await picture("sliders", true);
    await seen("delete document.body.dataset.done");
    await seen("document.getElementById('reset').click()");
    await done();
    found.after = await limits();
    // what sliders say is written into both files
    await move("forearm_link", "Math.log(2)");
    await seen("delete document.body.dataset.done");
    await seen("document.getElementById('take').click()");
    await done();
    found.taken = await seen(`[/mass value="4\\.5[45]/.test(document.getElementById("robot").value), document.getElementById("scene").value.split("[[drive]]").length - 1]`);
    found.takenLimits = await limits();
    return { ...(await seen(FACTS)), ...found };
  },
  // texts of a file: [{ name, text }], what the page says of each
  async files() {
    await opened("robot=planar_2r.toml&t=1");
    await done();
    const all = [];
    for (const { name, text } of JSON.parse(fs.readFileSync(path.join(folder, "files.json"), "utf8"))) {
      await seen("delete document.body.dataset.done");
      await seen(`open(${JSON.stringify(name)}, ${JSON.stringify(text)})`);
      await done();
      all.push({ name, ...(await seen(FACTS)) });
      if (name.startsWith("picture")) await picture(name.replace(/[^a-z-]/g, ""), true);
    }
    return all;
  },
};

(async () => {
  let failed = null, result = null;
  try {
    const { targetId } = await send("Target.createTarget", { url: "about:blank" });
    ({ sessionId: session } = await send("Target.attachToTarget", { targetId, flatten: true }));
    for (const domain of ["Page", "Runtime", "Log", "Network"]) await send(`${domain}.enable`);
    result = await SCENARIOS[scenario]();
  } catch (error) {
    failed = error.stack;
  }
  const foreign = requests.filter((url) => !url.startsWith("file://") && !url.startsWith("about:") && !url.startsWith("blob:"));
  console.log(JSON.stringify({ failed, result, said, foreign }));
  browser.kill();
  process.exit(failed ? 1 : 0);
})();
