// The catheter as a tube inside a translucent vessel, on WebGL.
"use strict";

/** An unloaded instrument is dark on a light ground and light on a dark one. */
const UNLOADED = matchMedia("(prefers-color-scheme: dark)").matches ? [0.52, 0.6, 0.72] : [0.16, 0.24, 0.36];
const COLOUR_STOPS = [
  [0.0, UNLOADED], [0.2, [0.11, 0.45, 0.67]], [0.4, [0.16, 0.68, 0.55]],
  [0.6, [0.93, 0.76, 0.2]], [0.8, [0.92, 0.45, 0.13]], [1.0, [0.78, 0.1, 0.16]],
];

/** Colour of a share 0…1 of the scale. */
function colourOf(share) {
  const s = Math.min(1, Math.max(0, share));
  const upper = Math.max(1, COLOUR_STOPS.findIndex(([at]) => at >= s));
  const [[a, p], [b, q]] = [COLOUR_STOPS[upper - 1], COLOUR_STOPS[upper]];
  return p.map((x, k) => x + (s - a) / (b - a) * (q[k] - x));
}

const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const n = Math.hypot(...a) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };

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
  float lit = 0.55 + 0.45 * abs(dot(m, light));
  if (shell > 0.5) {
    // Seen edge-on the wall is dense, face-on it is clear.
    gl_FragColor = vec4(tint * lit, shell > 1.5 ? 0.05 + 0.5 * pow(1.0 - facing, 2.5) : 0.30);
  } else {
    float gloss = pow(max(dot(reflect(-light, m), e), 0.0), 24.0);
    gl_FragColor = vec4(c * (0.45 + 0.6 * max(dot(m, light), 0.0)) + 0.22 * gloss, 1.0);
  }
}`;

class Scene {
  /** vessel: { vertices: Float32Array, normals, indices: Uint32Array } in mm; radii in mm. */
  constructor(canvas, vessel, radius, wireRadius) {
    this.canvas = canvas; this.radius = radius; this.wireRadius = wireRadius;
    const gl = canvas.getContext("webgl", { antialias: true, alpha: true, preserveDrawingBuffer: true });
    if (!gl || !gl.getExtension("OES_element_index_uint")) throw new Error("this browser has no WebGL");
    this.gl = gl;
    this.program = this.link();
    this.place = {};
    for (const name of ["position", "normal", "colour"]) this.place[name] = gl.getAttribLocation(this.program, name);
    for (const name of ["view", "projection", "tint", "shell"]) this.place[name] = gl.getUniformLocation(this.program, name);
    this.wall = this.mesh(gl.STATIC_DRAW, vessel.vertices, vessel.normals, new Float32Array(vessel.vertices.length), vessel.indices);
    this.frameOn(vessel.vertices);
    this.control();
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  link() {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text); gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    return program;
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

  /** Looks at the broad side of the vessel, its long side across the picture. */
  frameOn(vertices) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < vertices.length; i++) {
      low[i % 3] = Math.min(low[i % 3], vertices[i]); high[i % 3] = Math.max(high[i % 3], vertices[i]);
    }
    this.centre = low.map((x, k) => (x + high[k]) / 2);
    this.size = low.map((x, k) => high[k] - x);
    const order = [0, 1, 2].sort((a, b) => this.size[b] - this.size[a]);
    const axis = (k) => [0, 1, 2].map((i) => (i === k ? 1 : 0));
    this.base = [axis(order[0]), axis(order[1]), cross(axis(order[0]), axis(order[1]))];
    this.across = [this.size[order[0]], this.size[order[1]]];
    this.reset();
  }

  reset() { this.yaw = -0.35; this.pitch = 0.42; this.zoom = 1; this.draw(); }

  control() {
    const c = this.canvas;
    c.addEventListener("pointerdown", (e) => c.setPointerCapture(e.pointerId));
    c.addEventListener("pointermove", (e) => {
      if (!e.buttons) return;
      this.yaw += e.movementX * 0.008;
      this.pitch = Math.min(1.5, Math.max(-1.5, this.pitch + e.movementY * 0.008));
      this.draw();
    });
    c.addEventListener("wheel", (e) => { e.preventDefault(); this.zoom = Math.min(8, Math.max(0.4, this.zoom * Math.exp(-e.deltaY * 0.001))); this.draw(); }, { passive: false });
    c.addEventListener("dblclick", () => this.reset());
  }

  /** points: centre line, tip first [mm]; shares: force over the scale, a point each; bare: points
   *  of guidewire ahead of the catheter. */
  setCatheter(points, shares, bare) {
    const { path, values } = smooth(points, shares), sides = 14, rings = path.length;
    const position = new Float32Array(rings * sides * 3), normal = position.slice(), colour = position.slice();
    const indices = new Uint32Array((rings - 1) * sides * 6);
    let side = null;
    for (let i = 0; i < rings; i++) {
      const along = unit(add(path[Math.min(i + 1, rings - 1)], path[Math.max(i - 1, 0)], -1));
      side = side ?? (Math.abs(along[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]);
      side = unit(add(side, along, -dot(side, along)));
      const other = cross(along, side), rgb = colourOf(values[i]);
      // The tip is rounded off.
      const thick = i < bare * PARTS ? this.wireRadius : this.radius;
      const radius = thick * (i === 0 ? 0.25 : i === 1 ? 0.8 : 1);
      for (let j = 0; j < sides; j++) {
        const a = 2 * Math.PI * j / sides, at = (i * sides + j) * 3;
        const n = add(side.map((x) => x * Math.cos(a)), other, Math.sin(a));
        position.set(add(path[i], n, radius), at); normal.set(n, at); colour.set(rgb, at);
        if (i + 1 < rings) {
          const p = i * sides + j, q = i * sides + (j + 1) % sides;
          indices.set([p, q, p + sides, q, q + sides, p + sides], (i * sides + j) * 6);
        }
      }
    }
    const old = this.tube;
    this.tube = this.mesh(this.gl.DYNAMIC_DRAW, position, normal, colour, indices);
    if (old) for (const name of ["position", "normal", "colour", "indices"]) this.gl.deleteBuffer(old[name]);
    this.draw();
  }

  camera() {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const [right, up, out] = this.base;
    const turn = (a, b, d) => [0, 1, 2].map((k) => a * right[k] + b * up[k] + d * out[k]);
    const rows = [turn(cy, 0, -sy), turn(-sy * sp, cp, -cy * sp), turn(sy * cp, sp, cy * cp)];
    const { width, height } = this.canvas, aspect = width / height, half = 0.21;
    const wide = this.across[0] * cy + this.size.reduce((a, b) => Math.min(a, b)) * Math.abs(sy);
    const distance = Math.max(this.across[1] * 1.2, wide * 0.98 / aspect) / (2 * half) / this.zoom + this.across[1];
    this.pixelPerMm = this.canvas.clientHeight / (2 * half * distance);
    const c = this.centre, near = distance * 0.05, far = distance * 4 + 500;
    const view = [
      rows[0][0], rows[1][0], rows[2][0], 0, rows[0][1], rows[1][1], rows[2][1], 0,
      rows[0][2], rows[1][2], rows[2][2], 0, -dot(rows[0], c), -dot(rows[1], c), -dot(rows[2], c) - distance, 1,
    ];
    const f = 1 / half;
    const projection = [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
    return { view, projection };
  }

  draw() {
    const { gl, canvas } = this, ratio = window.devicePixelRatio || 1;
    if (!this.wall || !canvas.clientWidth) return;
    canvas.width = canvas.clientWidth * ratio; canvas.height = canvas.clientHeight * ratio;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST); gl.useProgram(this.program);
    const { view, projection } = this.camera();
    gl.uniformMatrix4fv(this.place.view, false, view); gl.uniformMatrix4fv(this.place.projection, false, projection);
    gl.uniform3f(this.place.tint, 0.78, 0.42, 0.42);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.CULL_FACE);
    // Far wall, then the catheter, then the near wall over both. The wall's faces look inwards.
    gl.enable(gl.BLEND); gl.depthMask(false); gl.cullFace(gl.BACK); this.paint(this.wall, 1);
    gl.disable(gl.BLEND); gl.depthMask(true); gl.disable(gl.CULL_FACE);
    if (this.tube) this.paint(this.tube, 0);
    gl.enable(gl.CULL_FACE); gl.enable(gl.BLEND); gl.depthMask(false); gl.cullFace(gl.FRONT); this.paint(this.wall, 2);
    gl.depthMask(true);
    this.onDraw?.();
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

/** Points of the drawn line a link. */
const PARTS = 4;

/** PARTS points a link on a Catmull–Rom spline; values in between are linear. */
function smooth(points, shares) {
  const path = [], values = [], last = points.length - 1;
  for (let i = 0; i < last; i++) {
    const [a, b, c, d] = [points[Math.max(i - 1, 0)], points[i], points[i + 1], points[Math.min(i + 2, last)]];
    for (let j = 0; j < PARTS; j++) {
      const u = j / PARTS;
      path.push(b.map((x, k) => x + 0.5 * u * (c[k] - a[k] + u * (2 * a[k] - 5 * x + 4 * c[k] - d[k] + u * (3 * (x - c[k]) + d[k] - a[k])))));
      values.push(shares[i] + u * (shares[i + 1] - shares[i]));
    }
  }
  path.push(points[last]); values.push(shares[last]);
  return { path, values };
}
