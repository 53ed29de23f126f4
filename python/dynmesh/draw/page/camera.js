// One camera for all panes: it fits everything that is shown in any frame until the user moves it.

const margin = 1.06;

class Camera {
  constructor(panes, stage) {
    Object.assign(this, { panes, stage, isMoved: false });
    let isPassedOn = false;
    for (const { node, plot } of panes) {
      for (const event of ['pointerdown', 'wheel']) {
        node.addEventListener(event, () => { this.isMoved = true; }, { capture: true, passive: true });
      }
      plot.on(plot.events.CAMERA_CHANGE, (placed) => {
        if (isPassedOn) return; // the other plots report the change as well
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
    const beside = height / this.distance(width / count / height);
    const above = height / count / this.distance(width / (height / count));
    this.stage.style.flexDirection = beside >= above ? 'row' : 'column';
  }

  reset() {
    this.isMoved = false;
    const [right, up, towards] = told.camera.axes;
    const { clientWidth: width, clientHeight: height } = this.panes[0].node;
    const distance = this.distance(width / height);
    const [x, y] = this.middle();
    const target = right.map((_, i) => x * right[i] + y * up[i]);
    const position = target.map((_, i) => target[i] + distance * towards[i]);
    for (const { plot } of this.panes) plot.setCamera([...position, ...target, ...told.camera.up]);
  }

  // Calls for each vertex of each frame with its place to the right, above and towards the viewer.
  each(call) {
    const [right, up, towards] = told.camera.axes.map((axis) => axis.map((x) => x / told.grid));
    for (const { positions } of this.panes) {
      for (let frame = 0; frame < positions.length; frame += 3 * size) {
        for (let i = frame; i < frame + size; i++) {
          const x = positions[i], y = positions[i + size], z = positions[i + 2 * size];
          call(
            right[0] * x + right[1] * y + right[2] * z,
            up[0] * x + up[1] * y + up[2] * z,
            towards[0] * x + towards[1] * y + towards[2] * z,
          );
        }
      }
    }
  }

  middle() {
    if (!this.known) {
      const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
      this.each((x, y) => {
        low[0] = Math.min(low[0], x); high[0] = Math.max(high[0], x);
        low[1] = Math.min(low[1], y); high[1] = Math.max(high[1], y);
      });
      this.known = low.map((value, i) => (value + high[i]) / 2);
    }
    return this.known;
  }

  // The distance of the camera at which everything fits in a pane of this width to height.
  distance(proportion) {
    const slope = Math.tan(told.camera.field_of_view * Math.PI / 360) / margin;
    const [middleX, middleY] = this.middle();
    let distance = 0.1;
    this.each((x, y, z) => {
      const across = Math.max(Math.abs(y - middleY), Math.abs(x - middleX) / proportion);
      distance = Math.max(distance, z + across / slope);
    });
    return distance;
  }
}
