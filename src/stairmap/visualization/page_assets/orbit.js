const FIELD_OF_VIEW = 0.75;

// A camera that turns around a point, z up; distances in m, angles in rad.
class Orbit {
  constructor(canvas, changed) {
    this.target = [0, 0, 0];
    this.azimuth = 0;
    this.elevation = 0.5;
    this.distance = 5;
    this.changed = changed;
    this.pointers = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
    }
    canvas.addEventListener("pointermove", (event) => this.move(event, canvas));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(Math.max(-100, Math.min(100, event.deltaY)) * 0.0015));
    }, { passive: false });
  }

  lookFrom(eye, target) {
    const offset = eye.map((value, axis) => value - target[axis]);
    this.target = [...target];
    this.distance = Math.hypot(...offset);
    this.azimuth = Math.atan2(offset[1], offset[0]);
    this.elevation = Math.asin(offset[2] / this.distance);
    this.changed();
  }

  eye() {
    const level = Math.cos(this.elevation) * this.distance;
    return [
      this.target[0] + level * Math.cos(this.azimuth),
      this.target[1] + level * Math.sin(this.azimuth),
      this.target[2] + Math.sin(this.elevation) * this.distance,
    ];
  }

  move(event, canvas) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const delta = [now[0] - before[0], now[1] - before[1]];
    if (this.pointers.size === 2) {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
      const span = (point) => Math.hypot(point[0] - other[0], point[1] - other[1]);
      this.zoom(span(before) / Math.max(span(now), 1));
      this.pan(delta[0] / 2, delta[1] / 2, canvas);
    } else if (event.buttons & 2 || event.shiftKey) {
      this.pan(delta[0], delta[1], canvas);
    } else {
      this.azimuth -= delta[0] * 0.006;
      this.elevation = Math.max(-1.5, Math.min(1.55, this.elevation + delta[1] * 0.006));
    }
    this.pointers.set(event.pointerId, now);
    this.changed();
  }

  pan(right, down, canvas) {
    const scale = (2 * Math.tan(FIELD_OF_VIEW / 2) * this.distance) / canvas.clientHeight;
    const [sine, cosine] = [Math.sin(this.azimuth), Math.cos(this.azimuth)];
    const tilt = Math.sin(this.elevation);
    this.target[0] += scale * (right * sine - down * cosine * tilt);
    this.target[1] += scale * (-right * cosine - down * sine * tilt);
    this.target[2] += scale * down * Math.cos(this.elevation);
  }

  zoom(factor) {
    this.distance = Math.max(0.3, Math.min(300, this.distance * factor));
    this.changed();
  }
}

// Column-major (4, 4) matrices, as WebGL takes them.
function multiply(a, b) {
  const result = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      for (let k = 0; k < 4; k++) result[column * 4 + row] += a[k * 4 + row] * b[column * 4 + k];
    }
  }
  return result;
}

function viewMatrix(eye, target) {
  const unit = (v) => v.map((value) => value / Math.hypot(...v));
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const back = unit(eye.map((value, axis) => value - target[axis]));
  const right = unit(cross([0, 0, 1], back));
  const up = cross(back, right);
  return new Float32Array([
    right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
  ]);
}

// The middle of the picture is moved up by a share of its height, because a table covers its bottom.
function projectionMatrix(aspect, near, far, raised) {
  const f = 1 / Math.tan(FIELD_OF_VIEW / 2);
  return new Float32Array([
    f / aspect, 0, 0, 0, 0, f, 0, 0, 0, -2 * raised, (far + near) / (near - far), -1,
    0, 0, (2 * far * near) / (near - far), 0,
  ]);
}
