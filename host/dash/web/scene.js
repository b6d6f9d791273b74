// The catheter in its vessel, on WebGL. Lengths in millimetres from the entry.

const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const n = Math.hypot(...a) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };

/** Viridis, which people of every colour vision can order; its dark end is lifted for dark grounds. */
const STOPS = [[0.32, 0.16, 0.5], [0.28, 0.26, 0.56], [0.22, 0.37, 0.56], [0.16, 0.48, 0.56], [0.13, 0.58, 0.54], [0.27, 0.69, 0.46], [0.52, 0.79, 0.31], [0.76, 0.86, 0.2], [0.99, 0.9, 0.15]];

/** Colour of a force, 0 to 1 N. */
export function colourOf(force) {
  const at = Math.min(1, Math.max(0, force)) * (STOPS.length - 1), low = Math.min(STOPS.length - 2, Math.floor(at));
  return STOPS[low].map((x, k) => x + (at - low) * (STOPS[low + 1][k] - x));
}
export const css = (rgb) => `rgb(${rgb.map((x) => Math.round(255 * x)).join(" ")})`;

const VERTEX = `
attribute vec3 position; attribute vec3 normal; attribute vec3 colour;
uniform mat4 view; uniform mat4 projection;
varying vec3 n; varying vec3 p; varying vec3 c;
void main() {
  vec4 q = view * vec4(position, 1.0);
  p = q.xyz; n = mat3(view) * normal; c = colour;
  gl_Position = projection * q;
}`;
const FRAGMENT = `
precision mediump float;
varying vec3 n; varying vec3 p; varying vec3 c;
uniform vec3 tint; uniform float shell;
void main() {
  vec3 m = normalize(n), e = normalize(-p);
  float facing = abs(dot(m, e));
  vec3 light = normalize(vec3(0.35, 0.6, 0.75));
  if (shell > 0.5) {
    float lit = 0.55 + 0.45 * abs(dot(m, light));
    gl_FragColor = vec4(tint * lit, shell > 1.5 ? 0.05 + 0.5 * pow(1.0 - facing, 2.5) : 0.28);
  } else {
    gl_FragColor = vec4(c * (0.5 + 0.55 * max(dot(m, light), 0.0)), 1.0);
  }
}`;

/** Ways to look: right and up on the screen, in the vessel's frame; the third axis comes towards the viewer. */
const PRESETS = {
  perspective: null,
  top: [[1, 0, 0], [0, 1, 0]],
  side: [[1, 0, 0], [0, 0, 1]],
  along: [[0, 1, 0], [0, 0, 1]],
};
export const VIEWS = Object.keys(PRESETS);

const SIDES = 10, PARTS = 3, TRAIL = 400;
/** Length of an arrow [mm for 1 N], and the least force that gets one [N]. */
const ARROW = 25, LEAST = 0.005;

export class Scene {
  constructor(canvas, view) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl", { antialias: true, alpha: true, preserveDrawingBuffer: true });
    if (!gl || !gl.getExtension("OES_element_index_uint")) throw new Error("this browser has no WebGL");
    this.gl = gl;
    this.program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(this.program));
    this.place = {};
    for (const name of ["position", "normal", "colour"]) this.place[name] = gl.getAttribLocation(this.program, name);
    for (const name of ["view", "projection", "tint", "shell"]) this.place[name] = gl.getUniformLocation(this.program, name);
    this.trail = [];
    this.preset = view;
    this.control();
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  /** vessel: { vertices, normals, indices } in mm; radius in mm. */
  load(vessel, radius) {
    for (const name of ["wall", "tube"]) this.drop(name);
    this.radius = radius;
    this.wall = this.mesh(this.gl.STATIC_DRAW, vessel.vertices, vessel.normals, new Float32Array(vessel.vertices.length), vessel.indices);
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < vessel.vertices.length; i++) {
      low[i % 3] = Math.min(low[i % 3], vessel.vertices[i]);
      high[i % 3] = Math.max(high[i % 3], vessel.vertices[i]);
    }
    this.centre = low.map((x, k) => (x + high[k]) / 2);
    this.size = low.map((x, k) => high[k] - x);
    this.trail = [];
    this.look(this.preset);
  }

  drop(name) {
    const old = this[name];
    if (old) for (const part of ["position", "normal", "colour", "indices"]) this.gl.deleteBuffer(old[part]);
    this[name] = null;
  }

  mesh(usage, position, normal, colour, indices) {
    const gl = this.gl, buffers = { count: indices.length };
    for (const [name, data] of Object.entries({ position, normal, colour })) {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name] = gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, data, usage);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers.indices = gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, usage);
    return buffers;
  }

  /** Looks from one of the presets. */
  look(preset) {
    this.preset = preset;
    if (!this.size) return;
    const order = [0, 1, 2].sort((a, b) => this.size[b] - this.size[a]);
    const axis = (k) => [0, 1, 2].map((i) => (i === k ? 1 : 0));
    const [right, up] = PRESETS[preset] ?? [axis(order[0]), axis(order[1])];
    this.base = [right, up, cross(right, up)];
    [this.yaw, this.pitch] = PRESETS[preset] ? [0, 0] : [-0.35, 0.42];
    this.zoom = 1;
    this.draw();
  }

  control() {
    const c = this.canvas;
    c.addEventListener("pointerdown", (e) => c.setPointerCapture(e.pointerId));
    c.addEventListener("pointermove", (e) => { if (e.buttons) this.turn(e.movementX * 0.008, e.movementY * 0.008); });
    c.addEventListener("wheel", (e) => { e.preventDefault(); this.scale(Math.exp(-e.deltaY * 0.001)); }, { passive: false });
    c.addEventListener("dblclick", () => this.look(this.preset));
    c.addEventListener("keydown", (e) => {
      const step = 0.1;
      const does = { ArrowLeft: () => this.turn(-step, 0), ArrowRight: () => this.turn(step, 0), ArrowUp: () => this.turn(0, -step), ArrowDown: () => this.turn(0, step), "+": () => this.scale(1.2), "-": () => this.scale(1 / 1.2), Home: () => this.look(this.preset) }[e.key];
      if (does) { e.preventDefault(); does(); }
    });
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.min(1.5, Math.max(-1.5, this.pitch + pitch));
    this.draw();
  }

  scale(factor) {
    this.zoom = Math.min(10, Math.max(0.4, this.zoom * factor));
    this.draw();
  }

  /** at: x, y, z of each node, the tip first [mm]; force: x, y, z on the vessel [N]. */
  show(at, force, withTrail = true) {
    const n = at.length / 3;
    if (n < 2 || !this.wall) { this.drop("tube"); this.draw(); return; }
    const node = (i) => [at[3 * i], at[3 * i + 1], at[3 * i + 2]];
    const load = (i) => [force[3 * i], force[3 * i + 1], force[3 * i + 2]];
    const nodes = Array.from({ length: n }, (_, i) => node(i));
    const sizes = nodes.map((_, i) => Math.hypot(...load(i)));
    if (!withTrail) this.trail = [];
    const last = this.trail[this.trail.length - 1];
    if (!last || Math.hypot(...add(nodes[0], last, -1)) > 0.2) {
      // A jump is another trial, or a scrub.
      if (last && Math.hypot(...add(nodes[0], last, -1)) > 10) this.trail = [];
      this.trail.push(nodes[0]);
      if (this.trail.length > TRAIL) this.trail.shift();
    }
    const path = [], values = [];
    for (let i = 0; i + 1 < n; i++) {
      const [a, b, c, d] = [nodes[Math.max(i - 1, 0)], nodes[i], nodes[i + 1], nodes[Math.min(i + 2, n - 1)]];
      for (let j = 0; j < PARTS; j++) {
        const u = j / PARTS;
        path.push(b.map((x, k) => x + 0.5 * u * (c[k] - a[k] + u * (2 * a[k] - 5 * x + 4 * c[k] - d[k] + u * (3 * (x - c[k]) + d[k] - a[k])))));
        values.push(sizes[i] + u * (sizes[i + 1] - sizes[i]));
      }
    }
    path.push(nodes[n - 1]);
    values.push(sizes[n - 1]);
    const parts = [this.tubeOf(path, (i) => colourOf(values[i]), this.radius)];
    if (this.trail.length > 1) parts.push(this.tubeOf(this.trail, () => [0.85, 0.33, 0.6], this.radius * 0.3));
    nodes.forEach((place, i) => {
      if (sizes[i] < LEAST) return;
      const way = unit(load(i)), length = Math.max(1.5, ARROW * Math.min(sizes[i], 1));
      parts.push(this.arrow(place, way, length, colourOf(sizes[i])));
    });
    const total = parts.reduce((sum, part) => sum + part.position.length, 0);
    const joined = { position: new Float32Array(total), normal: new Float32Array(total), colour: new Float32Array(total) };
    const indices = new Uint32Array(parts.reduce((sum, part) => sum + part.indices.length, 0));
    let vertex = 0, index = 0;
    for (const part of parts) {
      for (const name of ["position", "normal", "colour"]) joined[name].set(part[name], vertex * 3);
      for (let i = 0; i < part.indices.length; i++) indices[index + i] = part.indices[i] + vertex;
      vertex += part.position.length / 3;
      index += part.indices.length;
    }
    this.drop("tube");
    this.tube = this.mesh(this.gl.DYNAMIC_DRAW, joined.position, joined.normal, joined.colour, indices);
    this.draw();
  }

  tubeOf(path, rgb, radius) { return this.rings(path, rgb, () => radius); }

  arrow(from, way, length, rgb) {
    const head = Math.min(2.5, length * 0.5), wide = this.radius * 0.55, neck = add(from, way, length - head);
    return this.rings([from, neck, neck, add(from, way, length)], () => rgb, (i) => [wide, wide, 2.6 * wide, 0.02][i]);
  }

  rings(path, rgb, radius) {
    const n = path.length, position = [], normal = [], colour = [], indices = [];
    let side = null;
    for (let i = 0; i < n; i++) {
      const ahead = unit(add(path[Math.min(i + 1, n - 1)], path[Math.max(i - 1, 0)], -1));
      if (!side) side = unit(cross(ahead, Math.abs(ahead[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
      side = unit(add(side, ahead, -dot(side, ahead)));
      const other = cross(ahead, side), shade = rgb(i), wide = radius(i);
      for (let j = 0; j < SIDES; j++) {
        const a = 2 * Math.PI * j / SIDES, out = add(side.map((x) => x * Math.cos(a)), other, Math.sin(a));
        position.push(...add(path[i], out, wide));
        normal.push(...out);
        colour.push(...shade);
        if (i + 1 < n) {
          const p = i * SIDES + j, q = i * SIDES + (j + 1) % SIDES;
          indices.push(p, q, p + SIDES, q, q + SIDES, p + SIDES);
        }
      }
    }
    return { position, normal, colour, indices };
  }

  camera() {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const [right, up, out] = this.base;
    const turn = (a, b, d) => [0, 1, 2].map((k) => a * right[k] + b * up[k] + d * out[k]);
    const rows = [turn(cy, 0, -sy), turn(-sy * sp, cp, -cy * sp), turn(sy * cp, sp, cy * cp)];
    const along = (axis) => this.size.reduce((sum, x, k) => sum + x * Math.abs(axis[k]), 0);
    const { width, height } = this.canvas, aspect = width / height, half = 0.21;
    const distance = Math.max(along(rows[1]), along(rows[0]) / aspect) * 1.08 / (2 * half) / this.zoom + along(rows[2]) / 2;
    const c = this.centre, near = distance * 0.05, far = distance * 4 + 500, f = 1 / half;
    const view = [
      rows[0][0], rows[1][0], rows[2][0], 0, rows[0][1], rows[1][1], rows[2][1], 0,
      rows[0][2], rows[1][2], rows[2][2], 0, -dot(rows[0], c), -dot(rows[1], c), -dot(rows[2], c) - distance, 1,
    ];
    return { view, projection: [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0] };
  }

  draw() {
    const { gl, canvas } = this, ratio = window.devicePixelRatio || 1;
    if (!this.wall || !canvas.clientWidth) return;
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(this.program);
    const { view, projection } = this.camera();
    gl.uniformMatrix4fv(this.place.view, false, view);
    gl.uniformMatrix4fv(this.place.projection, false, projection);
    gl.uniform3f(this.place.tint, 0.78, 0.46, 0.44);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    // The far wall, then the catheter, then the near wall over both. The wall's faces look inwards.
    gl.enable(gl.CULL_FACE); gl.enable(gl.BLEND); gl.depthMask(false); gl.cullFace(gl.BACK);
    this.paint(this.wall, 1);
    gl.disable(gl.BLEND); gl.depthMask(true); gl.disable(gl.CULL_FACE);
    if (this.tube) this.paint(this.tube, 0);
    gl.enable(gl.CULL_FACE); gl.enable(gl.BLEND); gl.depthMask(false); gl.cullFace(gl.FRONT);
    this.paint(this.wall, 2);
    gl.depthMask(true);
  }

  paint(mesh, shell) {
    const gl = this.gl;
    gl.uniform1f(this.place.shell, shell);
    for (const name of ["position", "normal", "colour"]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, mesh[name]);
      gl.enableVertexAttribArray(this.place[name]);
      gl.vertexAttribPointer(this.place[name], 3, gl.FLOAT, false, 0, 0);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.indices);
    gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
  }
}

const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
export const floats = (text) => new Float32Array(bytesOf(text));
export const shorts = (text) => new Int16Array(bytesOf(text));
export const words = (text) => new Uint16Array(bytesOf(text));

/** The wall as the server packs it: 20 µm, 1/127, triangles. */
export function vesselOf(packed) {
  return {
    vertices: Float32Array.from(shorts(packed.vertices), (x) => x * 0.02),
    normals: Float32Array.from(new Int8Array(bytesOf(packed.normals)), (x) => x / 127),
    indices: new Uint32Array(bytesOf(packed.indices)),
  };
}
