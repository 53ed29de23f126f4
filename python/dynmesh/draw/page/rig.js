// The page of rig: its words, and a box whose coordinates are those of --crop. `told` holds the data of rig_page.py.

const panel = document.getElementById('rig'), crop = document.getElementById('rig-crop');
const plot = await K3DInstance;
document.title = told.title;
panel.querySelector('h1').textContent = told.title;
panel.querySelector('p').textContent = told.told;
for (const [colour, name] of told.cameras) {
  const cell = document.getElementById('rig-cameras').insertRow().insertCell();
  cell.append(document.createElement('i'), name);
  cell.firstChild.style.background = colour;
}

const size = Math.max(...told.box[0].map((low, axis) => told.box[1][axis] - low)) || 1;
const digits = Math.max(0, 2 - Math.floor(Math.log10(size)));
const corners = told.box.map((corner, side) => corner.map((x) => {
  const input = document.createElement('input');
  const step = 10 ** -digits; // the box as it begins holds everything
  Object.assign(input, { type: 'number', step, value: ((side ? Math.ceil : Math.floor)(x / step) * step).toFixed(digits) });
  input.addEventListener('input', draw);
  return input;
}));
for (const axis of [0, 1, 2]) {
  const row = document.getElementById('rig-box').insertRow();
  row.insertCell().textContent = `${'xyz'[axis]} from`;
  row.insertCell().append(corners[0][axis]);
  row.insertCell().textContent = 'to';
  row.insertCell().append(corners[1][axis]);
}
panel.querySelector('button').onclick = () => navigator.clipboard.writeText(crop.textContent);

function draw() {
  const [low, high] = corners.map((corner) => corner.map((input) => input.valueAsNumber));
  const isBox = low.every((x, axis) => x < high[axis]);
  crop.textContent = isBox ? `--crop ${[...low, ...high]}` : 'the second number must be larger than the first';
  if (!isBox) return;
  const lines = plot.getWorld().ObjectsById[told.lines];
  lines.position.set(...low);
  lines.scale.set(...high.map((x, axis) => x - low[axis]));
  lines.updateMatrixWorld();
  plot.render();
}

draw();
for (const _ of [1, 2]) await new Promise(requestAnimationFrame);
plot.setGrid(plot.parameters.grid); // again, as coordinates stand beside it only once it was drawn
