// Draws the layers of the scene with WebGL 2: lit triangles, a cloud of points, a grid on the floor.
const TRIANGLE_VERTEX = `#version 300 es
in vec3 position;
uniform mat4 view, projection;
out vec3 seen;
void main() {
  vec4 place = view * vec4(position, 1.0);
  seen = place.xyz;
  gl_Position = projection * place;
}`;

// The normal comes from the derivatives of the position: every face is flat.
const TRIANGLE_FRAGMENT = `#version 300 es
precision highp float;
in vec3 seen;
uniform vec3 color;
uniform vec3 light;
out vec4 pixel;
void main() {
  vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
  float shine = 0.62 + 0.42 * max(dot(normal, light), 0.0);
  pixel = vec4(color * shine, 1.0);
}`;

// Points are drawn a little behind where they are, so that a step hides those that agree with it.
const POINT_VERTEX = `#version 300 es
in vec3 position;
uniform mat4 view, projection;
uniform vec3 low, size;
uniform float voxel, pixels, behind;
out float height;
void main() {
  vec3 point = low + position * size;
  vec4 place = view * vec4(point, 1.0);
  gl_Position = projection * place;
  vec4 pushed = projection * vec4(place.xy, place.z - behind, 1.0);
  gl_Position.z = pushed.z / pushed.w * gl_Position.w;
  gl_PointSize = clamp(voxel * pixels / -place.z, 1.2, 16.0);
  height = point.z;
}`;

const POINT_FRAGMENT = `#version 300 es
precision highp float;
in float height;
uniform vec2 heights;
out vec4 pixel;
void main() {
  vec2 offset = gl_PointCoord - 0.5;
  if (dot(offset, offset) > 0.25) discard;
  float share = clamp((height - heights.x) / max(heights.y - heights.x, 0.1), 0.0, 1.0);
  pixel = vec4(mix(vec3(0.24, 0.36, 0.50), vec3(0.70, 0.77, 0.83), share), 1.0);
}`;

const LINE_FRAGMENT = `#version 300 es
precision highp float;
in vec3 seen;
uniform vec3 color;
out vec4 pixel;
void main() { pixel = vec4(color, 1.0); }`;

const BACKGROUND = [0.933, 0.945, 0.957];

function bytesFromBase64(text) {
  return Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
}

class Renderer {
  constructor(canvas, scene) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!this.gl) throw new Error("this browser has no WebGL 2");
    const gl = this.gl;
    gl.enable(gl.DEPTH_TEST);
    this.triangles = this.program(TRIANGLE_VERTEX, TRIANGLE_FRAGMENT);
    this.points = this.program(POINT_VERTEX, POINT_FRAGMENT);
    this.lines = this.program(TRIANGLE_VERTEX, LINE_FRAGMENT);
    this.layers = scene.layers.map((layer) => ({
      name: layer.name,
      visible: !layer.hidden,
      meshes: layer.meshes.map((mesh) => ({
        color: mesh.color.map((value) => value / 255),
        ...this.vertices(new Float32Array(bytesFromBase64(mesh.positions).buffer), gl.FLOAT, false),
      })),
    }));
    const steps = new Uint16Array(bytesFromBase64(scene.cloud.positions).buffer);
    this.cloud = { ...scene.cloud, visible: true, ...this.vertices(steps, gl.UNSIGNED_SHORT, true) };
    this.heights = scene.heights;
    this.grid = this.vertices(this.gridLines(scene), gl.FLOAT, false);
  }

  program(vertexText, fragmentText) {
    const gl = this.gl;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertexText], [gl.FRAGMENT_SHADER, fragmentText]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, "position");
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    return program;
  }

  vertices(values, type, normalized) {
    const gl = this.gl;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, type, normalized, 0, 0);
    return { array, count: values.length / 3 };
  }

  gridLines(scene) {
    const [x, y] = [0, 1].map((axis) => [
      Math.floor(scene.grid[0][axis]) - 1, Math.ceil(scene.grid[1][axis]) + 1,
    ]);
    const values = [];
    for (let i = x[0]; i <= x[1]; i++) values.push(i, y[0], scene.floor, i, y[1], scene.floor);
    for (let i = y[0]; i <= y[1]; i++) values.push(x[0], i, scene.floor, x[1], i, scene.floor);
    return new Float32Array(values);
  }

  draw(eye, target) {
    const gl = this.gl;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight].map((n) => Math.round(n * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      [this.canvas.width, this.canvas.height] = [width, height];
    }
    gl.viewport(0, 0, width, height);
    gl.clearColor(...BACKGROUND, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const distance = Math.hypot(...eye.map((value, axis) => value - target[axis]));
    this.view = viewMatrix(eye, target);
    this.projection = projectionMatrix(width / height, Math.max(distance / 100, 0.02), distance * 3 + 150, 0.05);
    this.drawTriangles();
    if (this.cloud.visible && this.cloud.count) this.drawCloud(height);
    this.use(this.lines);
    this.set(this.lines, "color", [0.8, 0.83, 0.86]);
    gl.bindVertexArray(this.grid.array);
    gl.drawArrays(gl.LINES, 0, this.grid.count);
  }

  drawTriangles() {
    const gl = this.gl;
    this.use(this.triangles);
    // The light stands above and to the side of whoever looks, so that treads and risers differ.
    const light = [0.35, 0.25, 0.9].map((value) => value / Math.hypot(0.35, 0.25, 0.9));
    const up = [this.view[8], this.view[9], this.view[10]];
    const mixed = light.map((value, axis) => 0.5 * value + 0.9 * up[axis]);
    this.set(this.triangles, "light", mixed.map((value) => value / Math.hypot(...mixed)));
    for (const layer of this.layers.filter((item) => item.visible)) {
      for (const mesh of layer.meshes) {
        this.set(this.triangles, "color", mesh.color);
        gl.bindVertexArray(mesh.array);
        gl.drawArrays(gl.TRIANGLES, 0, mesh.count);
      }
    }
  }

  drawCloud(height) {
    const gl = this.gl;
    const { points, cloud } = this;
    this.use(points);
    this.set(points, "low", cloud.low);
    this.set(points, "size", cloud.size);
    gl.uniform2fv(gl.getUniformLocation(points, "heights"), this.heights);
    const numbers = { voxel: cloud.voxel * 0.6, pixels: height / (2 * Math.tan(FIELD_OF_VIEW / 2)), behind: 0.08 };
    for (const [name, value] of Object.entries(numbers)) gl.uniform1f(gl.getUniformLocation(points, name), value);
    gl.bindVertexArray(cloud.array);
    gl.drawArrays(gl.POINTS, 0, cloud.count);
  }

  use(program) {
    const gl = this.gl;
    gl.useProgram(program);
    gl.uniformMatrix4fv(gl.getUniformLocation(program, "view"), false, this.view);
    gl.uniformMatrix4fv(gl.getUniformLocation(program, "projection"), false, this.projection);
  }

  set(program, name, values) {
    this.gl.uniform3fv(this.gl.getUniformLocation(program, name), values);
  }

  // Where a point of the scene lies on the page, in CSS pixels; null behind the eye.
  project(point) {
    const clip = multiply(this.projection, this.view);
    const [x, y, , w] = [0, 1, 2, 3].map(
      (row) => clip[row] * point[0] + clip[4 + row] * point[1] + clip[8 + row] * point[2] + clip[12 + row],
    );
    if (w <= 0) return null;
    return [(x / w + 1) / 2 * this.canvas.clientWidth, (1 - y / w) / 2 * this.canvas.clientHeight];
  }
}
