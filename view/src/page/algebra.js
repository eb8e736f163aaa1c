// Vectors, unit quaternions x, y, z, w, and matrices of four columns, by columns as WebGL takes them.
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const scaled = (a, k) => [a[0] * k, a[1] * k, a[2] * k];
const less = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.sqrt(dot(a, a));
const unit = (a) => scaled(a, 1 / (norm(a) || 1));
const mix = (a, b, s) => a + (b - a) * s;

function product(a, b) {
  return [
    a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
    a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
    a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
    a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
  ];
}
const conjugate = (q) => [-q[0], -q[1], -q[2], q[3]];

// v + 2 u × (u × v + w v)
function turned(q, v) {
  const t = add(cross(q, v), scaled(v, q[3]));
  return add(v, scaled(cross(q, t), 2));
}

// A pose is { at, turn }.
const STILL = { at: [0, 0, 0], turn: [0, 0, 0, 1] };
const place = (pose, point) => add(pose.at, turned(pose.turn, point));
const compose = (a, b) => ({ at: place(a, b.at), turn: product(a.turn, b.turn) });
function inverse(pose) {
  const turn = conjugate(pose.turn);
  return { at: scaled(turned(turn, pose.at), -1), turn };
}

// Between two poses: a straight way, and the shorter turn.
function between(a, b, s) {
  const sign = a.turn.reduce((sum, x, k) => sum + x * b.turn[k], 0) < 0 ? -1 : 1;
  const turn = a.turn.map((x, k) => mix(x, sign * b.turn[k], s));
  const length = Math.hypot(...turn);
  return { at: a.at.map((x, k) => mix(x, b.at[k], s)), turn: turn.map((x) => x / length) };
}

// The turn that brings z to this direction, of length one.
function towards(d) {
  if (d[2] < -0.999999) return [1, 0, 0, 0];
  const length = Math.sqrt(2 * (1 + d[2]));
  return [-d[1] / length, d[0] / length, 0, length / 2];
}

function matrix(pose) {
  const [x, y, z] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => turned(pose.turn, axis));
  return [...x, 0, ...y, 0, ...z, 0, ...pose.at, 1];
}

function times(a, b) {
  const c = new Array(16).fill(0);
  for (let j = 0; j < 4; j++) for (let i = 0; i < 4; i++) for (let k = 0; k < 4; k++) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
  return c;
}

function applied(m, p) {
  return [0, 1, 2, 3].map((i) => m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i]);
}

function perspective(angle, aspect, near, far) {
  const f = 1 / Math.tan(angle / 2);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0];
}

function looking(eye, target, up) {
  const back = unit(less(eye, target));
  const right = unit(cross(up, back));
  const over = cross(back, right);
  const rows = [right, over, back];
  return [0, 1, 2].flatMap((k) => [...rows.map((row) => row[k]), 0]).concat(rows.map((row) => -dot(row, eye)), 1);
}

// Points fall along the light onto the plane dot(up, p) = height.
function falling(light, up, height) {
  const slope = dot(light, up);
  const m = new Array(16).fill(0);
  for (let j = 0; j < 3; j++) for (let i = 0; i < 3; i++) m[4 * j + i] = (i === j ? 1 : 0) - (light[i] * up[j]) / slope;
  for (let i = 0; i < 3; i++) m[12 + i] = (light[i] * height) / slope;
  m[15] = 1;
  return m;
}
