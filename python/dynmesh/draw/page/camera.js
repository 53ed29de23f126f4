// One camera for all panes: it follows the subject along the ground, and fits everything that is shown in any frame until
// the user moves it.

const margin = 1.06;

class Camera {
  constructor(panes, stage) {
    const meshes = panes.filter((pane) => pane instanceof Pane); // scans may have points far away
    const middles = middlesOf(meshes.at(-1)); // of the reference, if there is one
    Object.assign(this, { panes, stage, meshes, middles, isMoved: false, isFollowing: true, middle: middles[0] });
    this.extremes = extremesOf(meshes, middles);
    let isPassedOn = false;
    for (const { node, plot } of panes) {
      for (const event of ['pointerdown', 'wheel']) {
        node.addEventListener(event, () => { this.isMoved = true; }, { capture: true, passive: true });
      }
      plot.on(plot.events.CAMERA_CHANGE, (placed) => {
        if (isPassedOn) return; // the other plots report the change as well
        this.placed = [...placed];
        isPassedOn = true;
        for (const pane of panes) if (pane.plot !== plot) pane.plot.setCamera(placed);
        isPassedOn = false;
      });
    }
    new ResizeObserver(() => { this.arrange(); if (!this.isMoved) this.reset(); }).observe(stage);
  }

  // Places panes side by side or one above another, whichever shows the mesh larger.
  arrange() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    const count = this.panes.length;
    const beside = height / this.view(width / count / height).distance;
    const above = height / count / this.view(width / (height / count)).distance;
    this.stage.style.flexDirection = beside >= above ? 'row' : 'column';
  }

  follow(frame) {
    if (!this.isFollowing) return;
    const before = this.middle;
    this.middle = this.middles[frame];
    const by = this.middle.map((place, i) => place - before[i]);
    if (this.placed) this.place(this.placed.map((place, i) => (i < 6 ? place + by[i % 3] : place)));
  }

  // Follows the subject or stays, in turn.
  toggle(frame) {
    this.isFollowing = !this.isFollowing;
    this.middle = this.isFollowing ? this.middles[frame] : [0, 0, 0];
    this.extremes = extremesOf(this.meshes, this.isFollowing ? this.middles : null);
    this.arrange();
    this.reset();
  }

  place(placed) {
    this.placed = placed;
    for (const { plot } of this.panes) plot.setCamera(placed);
  }

  reset() {
    this.isMoved = false;
    const [right, up, towards] = told.camera.axes;
    const { clientWidth: width, clientHeight: height } = this.panes[0].node;
    const { distance, x, y } = this.view(width / height);
    const target = right.map((_, i) => this.middle[i] + x * right[i] + y * up[i]);
    const position = target.map((_, i) => target[i] + distance * towards[i]);
    this.place([...position, ...target, ...told.camera.up]);
  }

  // The distance of the camera, and the place to the right and above that it looks at, with which
  // everything just fits in a pane of this width to height.
  view(proportion) {
    const slope = Math.tan(told.camera.field_of_view * Math.PI / 360) / margin;
    let x = 0, y = 0, distance = 0;
    for (let round = 0; round < 3; round++) {
      distance = 0.1;
      for (const [right, above, nearer] of this.extremes) {
        const across = Math.max(Math.abs(above - y), Math.abs(right - x) / proportion);
        distance = Math.max(distance, nearer + across / slope);
      }
      if (round === 2) break;
      const edges = edgesOf(this.extremes, x, y, distance);
      x += distance * (edges.left + edges.right) / 2;
      y += distance * (edges.below + edges.above) / 2;
    }
    return { distance, x, y };
  }
}

// The directions in which a camera sees the outermost points, as tangents.
function edgesOf(points, x, y, distance) {
  const edges = { left: Infinity, right: -Infinity, below: Infinity, above: -Infinity };
  for (const [right, above, nearer] of points) {
    const away = Math.max(distance - nearer, 1e-3);
    edges.left = Math.min(edges.left, (right - x) / away);
    edges.right = Math.max(edges.right, (right - x) / away);
    edges.below = Math.min(edges.below, (above - y) / away);
    edges.above = Math.max(edges.above, (above - y) / away);
  }
  return edges;
}

// Where the subject is on the ground in each frame: the mean of its vertices.
function middlesOf({ positions }) {
  const middles = [];
  for (let frame = 0; frame < positions.length; frame += 3 * size) {
    middles.push(told.camera.up.map((isUp, axis) => {
      const sum = positions.subarray(frame + axis * size, frame + (axis + 1) * size).reduce((a, b) => a + b, 0);
      return isUp ? 0 : sum / size / told.grid;
    }));
  }
  return middles;
}

// Yields all vertices of all frames: how far to the right, above and towards the viewer, from the middles if there are some.
function* pointsOf(panes, middles) {
  const { axes } = told.camera;
  const [right, up, towards] = axes.map((axis) => axis.map((x) => x / told.grid));
  const point = [0, 0, 0]; // one for all, as there are millions
  for (const { positions } of panes) {
    for (let frame = 0; frame < positions.length; frame += 3 * size) {
      const middle = middles ? middles[frame / (3 * size)] : [0, 0, 0];
      const [r, u, t] = axes.map((axis) => axis[0] * middle[0] + axis[1] * middle[1] + axis[2] * middle[2]);
      for (let i = frame; i < frame + size; i++) {
        const x = positions[i], y = positions[i + size], z = positions[i + 2 * size];
        point[0] = right[0] * x + right[1] * y + right[2] * z - r;
        point[1] = up[0] * x + up[1] * y + up[2] * z - u;
        point[2] = towards[0] * x + towards[1] * y + towards[2] * z - t;
        yield point;
      }
    }
  }
}

// Only points near the edge of what a camera sees determine where it must be.
function extremesOf(panes, middles) {
  const distance = 4;
  const { left, right, below, above } = edgesOf(pointsOf(panes, middles), 0, 0, distance);
  const isInside = (place, low, high) => Math.abs(place - (low + high) / 2) < 0.4 * (high - low);
  const extremes = [];
  for (const point of pointsOf(panes, middles)) {
    const [x, y, nearer] = point;
    const away = distance - nearer;
    if (!isInside(x / away, left, right) || !isInside(y / away, below, above)) {
      extremes.push([...point]);
    }
  }
  return extremes;
}
