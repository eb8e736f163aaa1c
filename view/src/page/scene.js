// Solids by WebGL2: every one is a lathed profile, turned, scaled and pulled apart by one shader.
const SOLID_VERTEX = `#version 300 es
uniform mat4 view, model, fall;
uniform vec3 size;
uniform float pull;
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float far;
out vec3 at, side;
void main() {
  vec4 world = fall * (model * vec4(position * size + vec3(0.0, 0.0, far * pull), 1.0));
  at = world.xyz;
  side = mat3(model) * (normal / size);
  gl_Position = view * world;
}`;
const SOLID_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 colour;
uniform vec3 eye, up, light;
uniform float flatness;
uniform bool turnable;
in vec3 at, side;
out vec4 seen;
void main() {
  vec3 n = normalize(side), v = normalize(eye - at);
  if (dot(n, v) < 0.0 && turnable) n = -n;
  float sun = max(dot(n, light), 0.0), sky = 0.5 + 0.5 * dot(n, up);
  float shine = pow(max(dot(n, normalize(light + v)), 0.0), 48.0);
  float rim = pow(1.0 - max(dot(n, v), 0.0), 3.0);
  vec3 lit = colour.rgb * (0.42 + 0.26 * sky + 0.44 * sun) + 0.16 * shine + 0.10 * rim;
  seen = vec4(mix(lit, colour.rgb, flatness), colour.a);
}`;
const GROUND_VERTEX = `#version 300 es
uniform mat4 view;
uniform vec3 middle, across, along;
uniform float extent;
layout(location = 0) in vec3 position;
out vec3 at;
void main() {
  at = middle + extent * (position.x * across + position.y * along);
  gl_Position = view * vec4(at, 1.0);
}`;
const GROUND_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 colour;
uniform vec3 middle, across, along;
uniform float extent, spacing;
in vec3 at;
out vec4 seen;
float line(vec2 x) {
  vec2 off = abs(fract(x - 0.5) - 0.5) / fwidth(x);
  return 1.0 - min(min(off.x, off.y), 1.0);
}
void main() {
  vec2 x = vec2(dot(at, across), dot(at, along)) / spacing;
  float strength = max(0.45 * line(x), line(x / 5.0));
  float fade = 1.0 - smoothstep(0.25, 1.0, length(at - middle) / extent);
  seen = vec4(colour.rgb, colour.a * strength * fade);
}`;

const ROUND = 32;
// A profile's points are [radius, z, normal's radius, normal's z, whether it is pulled].
function lathe(profile) {
  const numbers = [];
  const corner = ([r, z, nr, nz, far], k) => {
    const [s, c] = [Math.sin((2 * Math.PI * k) / ROUND), Math.cos((2 * Math.PI * k) / ROUND)];
    numbers.push(r * c, r * s, z, nr * c, nr * s, nz, far || 0);
  };
  for (let i = 0; i + 1 < profile.length; i++) {
    const [a, b] = [profile[i], profile[i + 1]];
    for (let k = 0; k < ROUND; k++) for (const [p, j] of [[a, k], [a, k + 1], [b, k + 1], [a, k], [b, k + 1], [b, k]]) corner(p, j);
  }
  return numbers;
}
function arc(from, to, steps, far) {
  return Array.from({ length: steps + 1 }, (_, k) => {
    const angle = mix(from, to, k / steps);
    return [Math.cos(angle), Math.sin(angle), Math.cos(angle), Math.sin(angle), far];
  });
}
function box() {
  const numbers = [];
  for (let k = 0; k < 3; k++) for (const side of [-0.5, 0.5]) {
    for (const [u, v] of [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]) {
      const point = [0, 0, 0];
      const normal = [0, 0, 0];
      [point[k], point[(k + 1) % 3], point[(k + 2) % 3]] = [side, u, v];
      normal[k] = 2 * side;
      numbers.push(...point, ...normal, 0);
    }
  }
  return numbers;
}
// Nine numbers per triangle, with the normals of their planes.
function plane(triangles) {
  const numbers = new Float32Array((triangles.length / 3) * 7);
  for (let k = 0; k + 8 < triangles.length; k += 9) {
    const [a, b, c] = [0, 3, 6].map((j) => [triangles[k + j], triangles[k + j + 1], triangles[k + j + 2]]);
    const normal = unit(cross(less(b, a), less(c, a)));
    [a, b, c].forEach((point, j) => numbers.set([...point, ...normal, 0], (k / 3 + j) * 7));
  }
  return numbers;
}
const QUARTER = Math.PI / 2;
const MESHES = {
  sphere: lathe(arc(-QUARTER, QUARTER, 18, 0)),
  capsule: lathe([...arc(-QUARTER, 0, 9, 0), ...arc(0, QUARTER, 9, 1)]),
  barrel: lathe([[0, -1, 0, -1], [0.9, -1, 0, -1], [0.9, -1, 0.5, -0.9], [1, -0.9, 0.9, -0.5], [1, -0.9, 1, 0], [1, 0.9, 1, 0], [1, 0.9, 0.9, 0.5], [0.9, 1, 0.5, 0.9], [0.9, 1, 0, 1], [0, 1, 0, 1]]),
  rod: lathe([[0, 0, 0, -1], [1, 0, 0, -1], [1, 0, 1, 0], [1, 1, 1, 0], [1, 1, 0, 1], [0, 1, 0, 1]]),
  cone: lathe([[0, 0, 0, -1], [1, 0, 0, -1], [1, 0, 0.9, 0.4], [0, 1, 0.9, 0.4]]),
  box: box(),
  square: [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]].flatMap(([x, y]) => [x, y, 0, 0, 0, 1, 0]),
};

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(made));
  const names = {};
  for (let k = 0; k < (gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS) || 0); k++) {
    const { name } = gl.getActiveUniform(made, k);
    names[name] = gl.getUniformLocation(made, name);
  }
  return { made, names };
}

// What draws into a canvas, these meshes too; null without WebGL2.
function renderer(canvas, more) {
  const gl = canvas.getContext("webgl2", { antialias: true, stencil: true, alpha: false, preserveDrawingBuffer: true });
  if (!gl) return null;
  let solid, ground, arrays;
  const start = () => {
    solid = program(gl, SOLID_VERTEX, SOLID_FRAGMENT);
    ground = program(gl, GROUND_VERTEX, GROUND_FRAGMENT);
    arrays = {};
    for (const [name, numbers] of Object.entries({ ...MESHES, ...more })) {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STATIC_DRAW);
      for (const [place, count, offset] of [[0, 3, 0], [1, 3, 12], [2, 1, 24]]) {
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, count, gl.FLOAT, false, 28, offset);
      }
      arrays[name] = { array, count: numbers.length / 7 };
    }
  };
  start();

  const same = matrix(STILL);
  function solids(items, fall, flatness, colour) {
    let vertices = 0;
    gl.uniformMatrix4fv(solid.names.fall, false, fall);
    gl.uniform1f(solid.names.flatness, flatness);
    for (const item of items) {
      const mesh = arrays[item.mesh];
      gl.bindVertexArray(mesh.array);
      gl.uniformMatrix4fv(solid.names.model, false, matrix(item.pose));
      gl.uniform3fv(solid.names.size, item.size);
      gl.uniform1f(solid.names.pull, item.pull || 0);
      gl.uniform4fv(solid.names.colour, colour || item.colour);
      gl.uniform1i(solid.names.turnable, item.turnable ? 1 : 0);
      gl.drawArrays(gl.TRIANGLES, 0, mesh.count);
      vertices += mesh.count;
    }
    return vertices;
  }

  // Draws { view, eye, axes, light, paper, grid: { colour, middle, extent, spacing }, shadow: { colour, height }, solid, glass, above };
  // returns how many corners were drawn.
  function draw(scene) {
    if (gl.isContextLost()) return 0;
    const { axes, grid } = scene;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...scene.paper, 1);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.useProgram(ground.made);
    gl.uniformMatrix4fv(ground.names.view, false, scene.view);
    for (const [name, value] of [["middle", grid.middle], ["across", axes[0]], ["along", axes[1]]]) gl.uniform3fv(ground.names[name], value);
    gl.uniform1f(ground.names.extent, grid.extent);
    gl.uniform1f(ground.names.spacing, grid.spacing);
    gl.uniform4fv(ground.names.colour, grid.colour);
    gl.bindVertexArray(arrays.square.array);
    gl.drawArrays(gl.TRIANGLES, 0, 6);

    gl.useProgram(solid.made);
    gl.uniformMatrix4fv(solid.names.view, false, scene.view);
    for (const [name, value] of [["eye", scene.eye], ["up", axes[2]], ["light", scene.light]]) gl.uniform3fv(solid.names[name], value);
    // each point of the ground is darkened once; from below there is no shadow
    if (dot(scene.eye, axes[2]) > scene.shadow.height) {
      gl.enable(gl.STENCIL_TEST);
      gl.stencilFunc(gl.EQUAL, 0, 255);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
      solids(scene.solid, falling(scene.light, axes[2], scene.shadow.height), 1, scene.shadow.colour);
      gl.disable(gl.STENCIL_TEST);
    }
    gl.depthMask(true);
    let vertices = 6 + solids(scene.solid, same, 0);
    // far sides of what is transparent, then the near ones
    gl.depthMask(false);
    gl.enable(gl.CULL_FACE);
    for (const face of [gl.FRONT, gl.BACK]) {
      gl.cullFace(face);
      vertices += solids(scene.glass, same, face === gl.FRONT ? 0.6 : 0);
    }
    gl.disable(gl.CULL_FACE);
    gl.depthMask(true);
    // frames and arrows are seen through the robot
    gl.clear(gl.DEPTH_BUFFER_BIT);
    return vertices + solids(scene.above, same, 0.35);
  }
  return { draw, start, error: () => gl.getError() };
}
