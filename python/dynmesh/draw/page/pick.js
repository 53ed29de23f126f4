// Picks landmarks. K3DInstance, lib and the snapshot's canvas belong to the page that runs this script; `told`
// holds the data of pick.py.

const part = (name) => document.getElementById(`dynmesh-${name}`);
const floats = async (text, Kind) => new Kind((await unpacked(text)).buffer);
const reach = 12; // pixels around a click
const depth = 0.2; // of the longest side: so far behind another one counts as much as a reach beside it
const picks = []; // { side, index }, in the order of the clicks

class Side {
  constructor(node, plot, points, mark) {
    Object.assign(this, { node, plot, points, mark });
    let from = null;
    node.addEventListener('pointerdown', (event) => { from = [event.clientX, event.clientY]; }, true);
    node.addEventListener('pointerup', ({ clientX: x, clientY: y, button }) => {
      const isClick = from && Math.hypot(x - from[0], y - from[1]) < 4 && button === 0;
      from = null;
      if (!isClick) return; // the view was turned
      const { left, top } = node.getBoundingClientRect();
      const found = this.nearest(x - left, y - top);
      if (found) pick(this, found.index);
    }, true);
  }

  // Returns a function of the number of a point: where it is in pixels of this side, and how far away.
  places() {
    const { camera } = this.plot.getWorld();
    camera.updateMatrixWorld();
    const view = camera.matrixWorldInverse.elements, lens = camera.projectionMatrix.elements;
    const { clientWidth: width, clientHeight: height } = this.node;
    return (index) => {
      const [x, y, z] = this.points.subarray(3 * index, 3 * index + 3);
      const [right, up, back] = [0, 1, 2].map((i) => view[i] * x + view[i + 4] * y + view[i + 8] * z + view[i + 12]);
      return [(1 - lens[0] * right / back) * width / 2, (1 + lens[5] * up / back) * height / 2, -back];
    };
  }

  // The point that is meant by a click: one around it, as near and as far in front as possible; null if none is.
  nearest(x, y) {
    const place = this.places();
    const around = [];
    for (let index = 0; index < this.points.length / 3; index++) {
      const [left, top, away] = place(index);
      const off = Math.hypot(left - x, top - y);
      if (off < reach && away > 0) around.push({ index, cost: off / reach + away / depth });
    }
    return around.reduce((best, one) => (best && best.cost <= one.cost ? best : one), null);
  }

  number(index, text) {
    const label = this.node.appendChild(document.createElement('b'));
    label.textContent = text;
    label.dataset.index = index;
  }

  arrange() {
    const place = this.places();
    for (const label of this.node.querySelectorAll('b')) {
      const [left, top] = place(Number(label.dataset.index));
      Object.assign(label.style, { left: `${left}px`, top: `${top}px` });
    }
  }
}

async function sideOf(name, plot, canvas, words) {
  const node = part(name);
  node.append(canvas);
  plot.resizeHelper();
  const { points, camera, up } = told[name];
  const fit = Math.max(1, node.clientHeight / node.clientWidth);
  plot.setCamera([...camera.map((x) => fit * x), 0, 0, 0, ...up]);
  return new Side(node, plot, await floats(points, Float32Array), words);
}

const target = document.createElement('div');
part('scan').append(target);
const bytes = Uint8Array.from(told.other.match(/../g), (pair) => parseInt(pair, 16));
const scanPlot = await lib.CreateK3DAndLoadBinarySnapshot(bytes, target);
const numbers = await floats(told.numbers, Uint32Array);
const positions = await floats(told.positions, Float64Array);
const position = (index) => [...positions.subarray(3 * index, 3 * index + 3)];
const template = await sideOf('template', K3DInstance, document.getElementById('canvasTarget'),
  (index) => `vertex ${numbers[index]}`);
const scan = await sideOf('scan', scanPlot, target,
  (index) => position(index).map((x) => x.toPrecision(4)).join(', '));
const sides = [template, scan];

const of = (side) => picks.filter((one) => one.side === side).map(({ index }) => index);
const pairs = () => of(template).slice(0, of(scan).length).map((vertex, i) => (
  { vertex: numbers[vertex], position: position(of(scan)[i]) }
));

function pick(side, index) {
  const [ours, theirs] = [side, sides.find((other) => other !== side)].map((one) => of(one).length);
  if (ours > theirs) picks.splice(picks.findLastIndex((one) => one.side === side), 1); // another choice
  picks.push({ side, index });
  show();
}

function show() {
  part('pairs').replaceChildren();
  for (const side of sides) {
    side.node.querySelectorAll('b').forEach((label) => label.remove());
    of(side).forEach((index, i) => side.number(index, i + 1));
  }
  const [ours, theirs] = sides.map(of);
  for (let i = 0; i < Math.max(ours.length, theirs.length); i++) {
    const row = part('pairs').insertRow();
    row.insertCell().textContent = i + 1;
    row.insertCell().textContent = i in ours ? template.mark(ours[i]) : '';
    row.insertCell().textContent = i in theirs ? scan.mark(theirs[i]) : '';
  }
  part('undo').disabled = !picks.length;
  part('save').disabled = !pairs().length;
}

part('undo').onclick = () => { picks.pop(); show(); };
part('save').onclick = () => {
  const link = document.createElement('a');
  const text = `${JSON.stringify(pairs(), null, 2)}\n`;
  link.href = URL.createObjectURL(new Blob([text], { type: 'application/json' }));
  link.download = told.file;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
};

document.title = told.title;
part('name').textContent = told.title;
(function follow() {
  for (const side of sides) side.arrange();
  requestAnimationFrame(follow);
})();
for (let frame = 0; frame < 3; frame++) await new Promise(requestAnimationFrame); // until both are drawn
part('pairs').dataset.ready = 'yes';
