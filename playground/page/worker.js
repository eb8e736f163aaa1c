// Runs the compiler beside the page, and the robot's own functions. A panic ends the instance, not the page: the next request gets another one.
let compiled, instance;
const encoder = new TextEncoder();
const decoder = new TextDecoder();

function fresh() {
  instance = new WebAssembly.Instance(compiled, {});
  instance.exports.start();
}
function textAt(address) {
  const memory = instance.exports.memory.buffer;
  const length = new DataView(memory).getUint32(address, true);
  return decoder.decode(new Uint8Array(memory, address + 4, length));
}
function put(text) {
  const bytes = encoder.encode(text);
  const address = instance.exports.alloc(bytes.length);
  new Uint8Array(instance.exports.memory.buffer, address, bytes.length).set(bytes);
  return [address, bytes.length];
}
function asked(name, request) {
  try {
    if (!instance) fresh();
    return JSON.parse(textAt(instance.exports.call(...put(name), ...put(JSON.stringify(request)))));
  } catch (error) {
    let why = "";
    try {
      const address = instance.exports.last_panic();
      if (address > 4) why = textAt(address);
    } catch {
      // memory itself may be gone
    }
    instance = null;
    return { failure: why || `the compiler stopped: ${error.message}` };
  }
}

function bytesOf(text) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return bytes;
}
const numbersOf = (text) => new Float64Array(bytesOf(text).buffer);
function textOf(array) {
  const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
  let raw = "";
  for (let k = 0; k < bytes.length; k += 8192) raw += String.fromCharCode(...bytes.subarray(k, k + 8192));
  return btoa(raw);
}

// The robot's own functions: f(name, [inputs]) gives all results.
function robotOf(answer) {
  const module = new WebAssembly.Module(bytesOf(answer.module));
  const { exports } = new WebAssembly.Instance(module, {});
  const memory = new Float64Array(exports.memory.buffer);
  const rows = new Map(answer.functions.map((of) => [of.name, of]));
  const count = (ports) => ports.reduce((sum, [, length]) => sum + length, 0);
  return (name, inputs) => {
    let place = 0;
    for (const input of inputs) {
      memory.set(input, place);
      place += input.length;
    }
    exports[name]();
    return memory.slice(answer.results_at, answer.results_at + count(rows.get(name).outputs));
  };
}
// Every function beside the interpreter's results, bit by bit; a NaN is a NaN.
function differences(answer, robot) {
  const found = [];
  for (const { name, inputs, outputs, states, results } of answer.functions) {
    const [given, expected] = [numbersOf(states), numbersOf(results)];
    const [taken, made] = [inputs, outputs].map((ports) => ports.reduce((sum, [, length]) => sum + length, 0));
    const bits = (numbers) => new BigUint64Array(numbers.buffer, numbers.byteOffset, numbers.length);
    for (let k = 0; k * made < expected.length; k++) {
      const own = robot(name, [given.subarray(k * taken, (k + 1) * taken)]);
      const other = expected.slice(k * made, (k + 1) * made);
      const [a, b] = [bits(own), bits(other)];
      if (own.some((x, i) => a[i] !== b[i] && !(Number.isNaN(x) && Number.isNaN(other[i])))) {
        found.push(name);
        break;
      }
    }
  }
  return found;
}

// Row by row: torques, and poses of the bodies as the view has them.
function moved(answer, robot, data) {
  const [q, qd, qdd] = [answer.q, answer.qd, answer.qdd].map(numbersOf);
  const rows = numbersOf(answer.times).length;
  const { nq, nv } = answer;
  const tau = new Float64Array(rows * nv);
  const gravity = new Float64Array(rows * nv);
  const has = (name) => answer.functions.some((of) => of.name === name);
  const poses = new Float32Array(bytesOf(data.poses).buffer);
  const takes = (name) => answer.functions.find((of) => of.name === name).inputs.map(([input]) => input);
  for (let row = 0; row < rows; row++) {
    const state = { q: q.subarray(row * nq, (row + 1) * nq), qd: qd.subarray(row * nv, (row + 1) * nv), qdd: qdd.subarray(row * nv, (row + 1) * nv) };
    const of = (name) => robot(name, takes(name).map((input) => state[input]));
    if (has("inverse_dynamics")) tau.set(of("inverse_dynamics"), row * nv);
    if (has("gravity_force")) gravity.set(of("gravity_force"), row * nv);
    if (has("forward_kinematics") && answer.frames.length) {
      const x = of("forward_kinematics");
      answer.frames.forEach((own, body) => poses.set(poseOf(x.subarray(12 * body, 12 * body + 12), own), 7 * (row * answer.frames.length + body)));
    }
  }
  return { tau, gravity, poses, rows };
}
// Position and quaternion x, y, z, w of a pose in another, both as position and rotation by rows.
function poseOf(x, own) {
  const [p, r] = [x.subarray(0, 3), x.subarray(3)];
  const at = [0, 1, 2].map((i) => p[i] + r[3 * i] * own[0] + r[3 * i + 1] * own[1] + r[3 * i + 2] * own[2]);
  const m = (i, j) => r[3 * i] * own[3 + j] + r[3 * i + 1] * own[6 + j] + r[3 * i + 2] * own[9 + j];
  // of the four squares the greatest is divided by
  const squares = [1 + m(0, 0) - m(1, 1) - m(2, 2), 1 - m(0, 0) + m(1, 1) - m(2, 2), 1 - m(0, 0) - m(1, 1) + m(2, 2), 1 + m(0, 0) + m(1, 1) + m(2, 2)];
  const k = squares.indexOf(Math.max(...squares));
  const s = 2 * Math.sqrt(squares[k]);
  const sums = (i, j) => (m(i, j) + m(j, i)) / s;
  const turns = [(m(2, 1) - m(1, 2)) / s, (m(0, 2) - m(2, 0)) / s, (m(1, 0) - m(0, 1)) / s];
  const quaternion = [[s / 4, sums(0, 1), sums(0, 2), turns[0]], [sums(0, 1), s / 4, sums(1, 2), turns[1]], [sums(0, 2), sums(1, 2), s / 4, turns[2]], [...turns, s / 4]][k];
  return [...at, ...quaternion];
}

// What was made last: of other motors on the same robot nothing is compiled again.
let kept = null;
function made(request, key) {
  const began = performance.now();
  kept = null;
  const answer = asked("bench", request);
  if (answer.failure || !answer.view) return answer;
  const data = JSON.parse(answer.view);
  delete answer.view;
  const result = { ...answer, data, milliseconds: { compiled: performance.now() - began } };
  if (!answer.module) return result;
  const robot = robotOf(answer);
  const wrong = differences(answer, robot);
  if (wrong.length) return { failure: `the module of ${wrong.join(", ")} differs from the program: please report this robot` };
  const { tau, gravity, poses, rows } = moved(answer, robot, data);
  data.poses = textOf(poses);
  Object.assign(result, { tau, gravity, checked: answer.functions.length });
  kept = { key, result, rows };
  return result;
}

function bench(request) {
  const began = performance.now();
  const hasMotors = request.motors && request.motors.length > 0;
  const key = JSON.stringify({ ...request, motors: null, whole: null });
  if (kept && kept.key === key && hasMotors && !request.whole) Object.assign(kept.result, { motors: request.motors, milliseconds: { compiled: 0 } });
  else {
    const result = made(request, key);
    if (!kept) return result;
  }
  const { result, rows } = kept;
  const { data, tau } = result;
  const drives = asked("drives", { ...request, tau: textOf(tau) });
  const names = new Map();
  const column = (prefix, name, numbers, at, stride) => names.set(`${prefix}.${name}`, Float32Array.from({ length: rows }, (_, row) => numbers[row * stride + at]));
  for (const { name, iv } of result.joints) column("tau", name, tau, iv, result.nv);
  result.drives = drives;
  if (drives.drives && drives.drives.length) {
    const count = drives.drives.length;
    for (const key of ["current", "input", "speed", "joule"]) drives[key] = numbersOf(drives[key]);
    drives.drives.forEach(({ name }, k) => {
      for (const [prefix, key] of [["i", "current"], ["u", "input"], ["speed", "speed"]]) column(prefix, name, drives[key].subarray(k * rows), 0, 1);
    });
    result.driveCount = count;
  }
  // columns are named in the order of the plots' lines
  for (const chart of data.charts) for (const line of chart.lines) {
    const prefix = { "Joint torques": "tau", "Joint forces": "tau", Currents: "i", "Inputs of drives": "u", "Speeds of motors": "speed" }[chart.title];
    const found = prefix && names.get(`${prefix}.${line.name}`);
    if (found && found.every(Number.isFinite)) data.columns[line.column] = textOf(found);
  }
  result.milliseconds.all = performance.now() - began;
  return result;
}

onmessage = ({ data: { id, name, request, module } }) => {
  if (module) compiled = module;
  if (name === "start") return postMessage({ id, answer: {} });
  let answer;
  try {
    if (name === "unpack") answer = { module: new WebAssembly.Module(unpacked(request.packed, request.size)) };
    else answer = name === "bench" ? bench(request) : asked(name, request);
  } catch (error) {
    answer = { failure: error.message };
  }
  postMessage({ id, answer });
};
