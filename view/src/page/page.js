// The page: reads the run, plays it, and lets it be turned. Names reach the document as text alone.
const DATA = JSON.parse(document.getElementById("data").textContent);
const at = (id) => document.getElementById(id);
function bytes(text) {
  const raw = atob(text);
  return Uint8Array.from(raw, (c) => c.charCodeAt(0)).buffer;
}
const TIMES = new Float64Array(bytes(DATA.times));
const POSES = new Float32Array(bytes(DATA.poses));
const COLUMNS = DATA.columns.map((text) => new Float32Array(bytes(text)));
const FIRST = TIMES[0];
const LAST = TIMES[TIMES.length - 1];
const REACH = DATA.reach;
const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;

// Poses against the parent: between two rows they keep joints together, as poses in the world would not.
function stored(row, body) {
  const p = POSES.subarray(7 * (row * DATA.bodies.length + body), 7 * (row * DATA.bodies.length + body) + 7);
  return { at: [p[0], p[1], p[2]], turn: [p[3], p[4], p[5], p[6]] };
}
function rowAt(time) {
  let [low, high] = [0, TIMES.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (TIMES[middle] <= time) low = middle;
    else high = middle;
  }
  // two rows may have one time
  const span = TIMES[high] - TIMES[low];
  return span > 0 ? low + Math.min(1, Math.max(0, (time - TIMES[low]) / span)) : low;
}
function posesAt(row) {
  const low = Math.floor(row);
  if (row === low) return DATA.bodies.map((_, k) => stored(low, k));
  const found = [];
  DATA.bodies.forEach(({ parent }, k) => {
    const own = (r) => (parent === null ? stored(r, k) : compose(inverse(stored(r, parent)), stored(r, k)));
    const pose = between(own(low), own(low + 1), row - low);
    found.push(parent === null ? pose : compose(found[parent], pose));
  });
  return found;
}
function columnAt(column, row) {
  const values = COLUMNS[column];
  const low = Math.floor(row);
  return mix(values[low], values[Math.min(low + 1, values.length - 1)], row - low);
}

// What can be shown and hidden.
const asked = new URLSearchParams(location.hash.slice(1));
const layers = new Map();
function layer(name, on, text) {
  const list = asked.get("show");
  const box = element("input");
  box.type = "checkbox";
  box.checked = list === null ? on : list.split(",").includes(name);
  layers.set(name, box.checked);
  box.addEventListener("change", () => {
    layers.set(name, box.checked);
    redraw();
  });
  const label = element("label");
  label.append(box, " ", text || name);
  at("layers").append(label);
}
const groups = new Map();
for (const arrow of DATA.arrows) {
  const sizes = COLUMNS[arrow.columns[0]].map((_, row) => Math.hypot(...arrow.columns.map((c) => COLUMNS[c][row])));
  const most = sizes.reduce((a, b) => Math.max(a, b), 0);
  const known = groups.get(arrow.group) || { most: 0, unit: arrow.moment ? "N·m" : "N", index: groups.size };
  known.most = Math.max(known.most, most);
  groups.set(arrow.group, known);
}
if (DATA.shapes.length) layer("shapes", true);
layer("capsules", !DATA.shapes.length);
layer("ellipsoids", true, "inertia ellipsoids");
layer("frames", false);
layer("names", false);
layer("ground", true);
if (DATA.base !== null) layer("follow", true, "follow the base");
for (const [name, { most, unit: measured }] of groups) layer(name, /residual|forces carried|joint torques/.test(name), `${name}, at most ${written(most, 3)} ${measured}`);

// Colours are those of the style, so that they follow the theme.
let paint = {};
function readColours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name, alpha) => {
    const value = parseInt(style.getPropertyValue(name).trim().slice(1), 16);
    const rgb = [(value >> 16) / 255, ((value >> 8) & 255) / 255, (value & 255) / 255];
    return alpha === undefined ? rgb : [...rgb, alpha];
  };
  paint = { stage: of("--stage"), body: of("--body", 1), fixed: of("--fixed", 1), glass: of("--glass", 0.26), grid: of("--grid", 1), shadow: of("--shade", 0.22) };
  paint.joints = Array.from({ length: COLOURS }, (_, k) => of(`--c${k}`, 1));
  paint.axes = ["--x", "--y", "--z"].map((name) => of(name, 1));
  paint.arrows = ["--a0", "--a1", "--a2", "--a3", "--a4", "--a5"].map((name) => of(name, 1));
}

function capsules(items, limb, pose, colour) {
  for (const end of limb.ends) {
    const length = norm(end);
    const own = { at: [0, 0, 0], turn: towards(scaled(end, 1 / length)) };
    items.push({ mesh: "capsule", pose: compose(pose, own), size: [limb.radius, limb.radius, limb.radius], pull: length, colour });
  }
}
function joint(items, body, pose, parent) {
  const r = body.limb.radius;
  // what slides away from where its joint stands is held by a rod
  if (body.kind === "slide") {
    const way = less(place(parent, body.home), pose.at);
    const length = norm(way);
    const own = { at: pose.at, turn: towards(scaled(way, 1 / (length || 1))) };
    if (length > r) items.push({ mesh: "capsule", pose: own, size: [0.45 * r, 0.45 * r, 0.45 * r], pull: length, colour: paint.fixed });
  }
  const colour = paint.joints[body.colour % COLOURS];
  if (body.kind === "turn") items.push({ mesh: "barrel", pose, size: [1.28 * r, 1.28 * r, 1.35 * r], colour });
  if (body.kind === "slide") items.push({ mesh: "barrel", pose, size: [0.72 * r, 0.72 * r, 2.6 * r], colour });
  if (body.kind === "ball") items.push({ mesh: "sphere", pose, size: [1.45 * r, 1.45 * r, 1.45 * r], colour });
  if (body.kind === "base" && !body.limb.ends.length) items.push({ mesh: "sphere", pose, size: [r, r, r], colour: paint.body });
}
function arrow(items, from, vector, thick, colour, heads) {
  const length = norm(vector);
  if (!(length > thick * 0.5)) return;
  const turn = towards(scaled(vector, 1 / length));
  const head = Math.min(length * 0.5, thick * 5);
  const own = (z) => ({ at: add(from, scaled(vector, z / length)), turn });
  items.push({ mesh: "rod", pose: own(0), size: [thick, thick, length - head], colour });
  for (let k = 0; k < heads; k++) items.push({ mesh: "cone", pose: own(length - head * (1 + 0.8 * k)), size: [2.6 * thick, 2.6 * thick, head], colour });
}
const AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

function solidsAt(row) {
  const poses = posesAt(row);
  const [solid, glass, above] = [[], [], []];
  if (layers.get("capsules")) {
    capsules(solid, DATA.world, STILL, paint.fixed);
    if (DATA.base === null) {
      const up = { at: [0, 0, 0], turn: towards(CAMERA.axes[2]) };
      solid.push({ mesh: "barrel", pose: up, size: [1.9 * DATA.world.radius, 1.9 * DATA.world.radius, 0.35 * DATA.world.radius], colour: paint.fixed });
    }
    DATA.bodies.forEach((body, k) => {
      capsules(solid, body.limb, poses[k], paint.body);
      joint(solid, body, poses[k], body.parent === null ? STILL : poses[body.parent]);
    });
  }
  if (layers.get("shapes")) {
    DATA.shapes.forEach(({ body, pose: p, form, size, colour }, k) => {
      const own = { at: p.slice(0, 3), turn: p.slice(3) };
      let pose = body === null ? own : compose(poses[body], own);
      if (form === "cylinder") pose = compose(pose, { at: [0, 0, -size[2] / 2], turn: [0, 0, 0, 1] });
      const mesh = { cylinder: "rod", mesh: `shape ${k}` }[form] || form;
      const item = { mesh, pose, size, colour: colour || paint.body, turnable: true };
      (item.colour[3] < 1 ? glass : solid).push(item);
    });
  }
  if (layers.get("ellipsoids")) {
    DATA.bodies.forEach(({ ellipsoid }, k) => {
      if (!ellipsoid) return;
      const pose = compose(poses[k], { at: ellipsoid.center, turn: ellipsoid.turn });
      glass.push({ mesh: "sphere", pose, size: ellipsoid.semi_axes.map((x) => Math.max(x, REACH * 1e-3)), colour: paint.glass });
      solid.push({ mesh: "sphere", pose, size: Array(3).fill(REACH * 0.008), colour: paint.glass.map((x, i) => (i < 3 ? x : 1)) });
    });
  }
  if (layers.get("frames")) {
    for (const { body, pose: p } of DATA.frames) {
      const own = { at: p.slice(0, 3), turn: p.slice(3) };
      const pose = body === null ? own : compose(poses[body], own);
      AXES.forEach((axis, k) => arrow(above, pose.at, scaled(turned(pose.turn, axis), REACH * 0.09), REACH * 0.0035, paint.axes[k], 1));
    }
  }
  for (const { group, body, moment, columns } of DATA.arrows) {
    const { most, index } = groups.get(group);
    if (!layers.get(group) || !most) continue;
    const values = columns.map((column) => columnAt(column, row));
    const local = values.length === 1 ? [0, 0, values[0]] : turned(DATA.bodies[body].link_turn, values);
    const vector = scaled(turned(poses[body].turn, local), (0.3 * REACH) / most);
    arrow(above, poses[body].at, vector, REACH * 0.007, paint.arrows[index % paint.arrows.length], moment ? 2 : 1);
  }
  return { poses, solid, glass, above };
}

const CAMERA = DATA.camera;
const camera = { ...CAMERA, target: [...CAMERA.target] };
function lookout(poses) {
  const [a, b, up] = CAMERA.axes;
  const { azimuth, elevation, distance } = camera;
  const out = [Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation)];
  const back = add(add(scaled(a, out[0]), scaled(b, out[1])), scaled(up, out[2]));
  let target = camera.target;
  if (layers.get("follow")) {
    const moved = less(poses[DATA.base].at, stored(0, DATA.base).at);
    target = add(target, less(moved, scaled(up, dot(moved, up))));
  }
  const eye = add(target, scaled(back, distance));
  const canvas = at("picture");
  const aspect = canvas.width / canvas.height;
  // a picture that is higher than wide sees as much from side to side
  const angle = aspect < 1 ? 2 * Math.atan(Math.tan(camera.field_of_view / 2) / aspect) : camera.field_of_view;
  const lens = perspective(angle, aspect, distance * 0.02, distance * 4 + 40 * REACH);
  return { eye, target, back, up, view: times(lens, looking(eye, target, up)) };
}

let drawing = null;
let [now, playing, before, waiting] = [FIRST, false, null, false];
let plots = [];
const SPACING = step(2 * REACH, 10);
const LIGHT = unit(CAMERA.axes.reduce((sum, axis, k) => add(sum, scaled(axis, [0.25, -0.45, 0.85][k])), [0, 0, 0]));

function redraw() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(frame);
}
function frame(moment) {
  waiting = false;
  if (playing) {
    if (before !== null) now += Math.min(0.1, (moment - before) / 1000) * Number(at("speed").value);
    if (now > LAST) now = FIRST;
    before = moment;
    redraw();
  }
  show();
}
function show() {
  const row = rowAt(now);
  at("time").value = String(now);
  at("time").setAttribute("aria-valuetext", `${now.toFixed(3)} seconds`);
  at("clock").textContent = `${now.toFixed(3)} s`;
  for (const plot of plots) plot.show(now, row);
  if (drawing) picture(row);
}
function picture(row) {
  const canvas = at("picture");
  const scene = solidsAt(row);
  const { view, eye, target, up } = lookout(scene.poses);
  const height = DATA.ground;
  const middle = add(target, scaled(up, height - dot(target, up)));
  const shown = layers.get("ground");
  const grid = { colour: [...paint.grid.slice(0, 3), shown ? 0.9 : 0], middle, extent: 4.5 * REACH, spacing: SPACING };
  const shadow = { colour: shown ? paint.shadow : [0, 0, 0, 0], height };
  const vertices = drawing.draw({ ...scene, view, eye, axes: CAMERA.axes, light: LIGHT, paper: paint.stage, grid, shadow });
  canvas.dataset.vertices = vertices;
  canvas.dataset.time = now;
  const error = drawing.error();
  if (error) problem(`WebGL reports the error ${error}.`);
  writeNames(scene.poses, view);
}

const tags = DATA.bodies.map(({ name, joint: of }) => {
  const tag = element("bdi", "tag", name);
  tag.title = of;
  at("labels").append(tag);
  return tag;
});
function writeNames(poses, view) {
  at("labels").hidden = !layers.get("names");
  if (!layers.get("names")) return;
  const { clientWidth: width, clientHeight: height } = at("picture");
  tags.forEach((tag, k) => {
    const [x, y, , w] = applied(view, poses[k].at);
    tag.hidden = w <= 0;
    tag.style.transform = `translate(${(((x / w + 1) / 2) * width).toFixed(1)}px, ${(((1 - y / w) / 2) * height).toFixed(1)}px)`;
  });
}
function problem(text) {
  at("problem").hidden = false;
  at("problem").textContent = text;
  at("picture").dataset.problem = text;
}

function seek(time) {
  now = Math.min(LAST, Math.max(FIRST, time));
  redraw();
}
function play(on) {
  playing = on && LAST > FIRST;
  before = null;
  at("play").setAttribute("aria-label", playing ? "Pause" : "Play");
  at("play").classList.toggle("playing", playing);
  redraw();
}

function turn(right, up) {
  camera.azimuth -= right;
  camera.elevation = Math.min(1.55, Math.max(-1.55, camera.elevation + up));
  redraw();
}
function move(right, up) {
  const { back, up: axis } = lookout(posesAt(rowAt(now)));
  const aside = unit(cross(axis, back));
  const over = cross(back, aside);
  camera.target = add(camera.target, add(scaled(aside, -right * camera.distance), scaled(over, up * camera.distance)));
  redraw();
}
function come(factor) {
  camera.distance = Math.min(100 * REACH, Math.max(0.05 * REACH, camera.distance * factor));
  redraw();
}

function listen(canvas) {
  const fingers = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  const end = (event) => fingers.delete(event.pointerId);
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, end);
  canvas.addEventListener("pointermove", (event) => {
    const from = fingers.get(event.pointerId);
    if (!from) return;
    const to = [event.clientX, event.clientY];
    const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    const other = [...fingers].find(([id]) => id !== event.pointerId);
    fingers.set(event.pointerId, to);
    if (other) {
      const apart = (p) => Math.hypot(p[0] - other[1][0], p[1] - other[1][1]) || 1;
      come(apart(from) / apart(to));
      move(dx / canvas.clientHeight / 3, dy / canvas.clientHeight / 3);
    } else if (event.buttons === 1 && !event.shiftKey) turn(dx * 0.008, dy * 0.008);
    else move((dx / canvas.clientHeight) * 0.6, (dy / canvas.clientHeight) * 0.6);
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    come(Math.exp(Math.max(-60, Math.min(60, event.deltaY)) * 0.003));
  }, { passive: false });
  const keys = {
    ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
  };
  canvas.addEventListener("keydown", (event) => {
    const way = keys[event.key];
    if (way && event.shiftKey) move(-way[0] * 0.03, -way[1] * 0.03);
    else if (way) turn(-way[0] * 0.1, -way[1] * 0.1);
    else if (event.key === "+" || event.key === "=") come(0.9);
    else if (event.key === "-") come(1 / 0.9);
    else if (event.key === "0") {
      Object.assign(camera, CAMERA, { target: [...CAMERA.target] });
      redraw();
    } else if (event.key === " ") play(!playing);
    else return;
    event.preventDefault();
  });
}

function begin() {
  document.title = `${DATA.title}: in motion`;
  at("title").textContent = DATA.title;
  for (const [name, value] of DATA.facts) {
    const pair = element("div");
    pair.append(element("dt", "", name), element("dd", "", value));
    at("facts").append(pair);
  }
  for (const note of DATA.notes) at("notes").append(element("li", "", note));
  const canvas = at("picture");
  canvas.setAttribute("aria-label", `${DATA.title} in three dimensions, with ${DATA.bodies.length} moving bodies`);
  at("scale").textContent = `grid ${written(SPACING, 2)} m`;
  const span = timeSpan(TIMES, () => plots.forEach((plot) => plot.layOut()));
  plots = DATA.charts.map((of) => chart(of, { times: TIMES, columns: COLUMNS, seek, span }));
  at("plots").prepend(...plots.map((plot) => plot.box));
  at("plot-keys").hidden = !plots.length;
  at("time").min = String(FIRST);
  at("time").max = String(LAST);
  at("time").addEventListener("input", () => seek(Number(at("time").value)));
  at("play").addEventListener("click", () => play(!playing));
  if (!(LAST > FIRST)) at("player").hidden = true;
  readColours();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    readColours();
    redraw();
  });
  try {
    const meshes = {};
    DATA.shapes.forEach(({ form, triangles }, k) => {
      if (form === "mesh") meshes[`shape ${k}`] = plane(new Float32Array(bytes(triangles)));
    });
    drawing = renderer(canvas, meshes);
    if (!drawing) problem("This browser has no WebGL2, which draws the robot; the plots need none.");
  } catch (error) {
    problem(`The robot cannot be drawn: ${error.message}`);
  }
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => {
    drawing.start();
    redraw();
  });
  new ResizeObserver(() => {
    const ratio = Math.min(2, devicePixelRatio || 1);
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    // at once: a canvas of another size is empty, and this frame's turn to draw is over
    show();
  }).observe(canvas);
  listen(canvas);
  if (asked.has("from") || asked.has("to")) {
    const bound = (name, otherwise) => (asked.has(name) && isFinite(asked.get(name)) ? Number(asked.get(name)) : otherwise);
    span.set(bound("from", FIRST), bound("to", LAST));
  }
  if (asked.has("t")) seek(Number(asked.get("t")) || 0);
  else play(!calm);
  redraw();
}
begin();
