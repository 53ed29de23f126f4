// Runs in a k3d snapshot when it is loaded. K3DInstance belongs to k3d; `markup` is player.html and
// `told` holds the data from player.py. The time of the plot is the index of a shown frame.
document.body.insertAdjacentHTML('beforeend', markup);
const part = (name) => document.getElementById(`dynmesh-${name}`);
const play = part('play'), slider = part('frame'), speed = part('speed');
const last = told.numbers.length - 1;
const usualRate = 25;

document.title = told.name;
part('name').textContent = told.name;
part('note').textContent = told.note && `shown: ${told.note}`;
slider.max = last;
slider.disabled = play.disabled = last === 0;
if (told.fps === null) {
  speed.title = `1 × is ${usualRate} frames per second; the file states no rate`;
}
if (told.scale) {
  const { title, colours, ticks } = told.scale;
  const bar = part('bar');
  const step = 100 / colours.length;
  const stops = colours.map((colour, i) => `${colour} ${i * step}% ${(i + 1) * step}%`);
  bar.style.background = `linear-gradient(to top, ${stops})`;
  bar.style.height = `${Math.min(260, 36 * colours.length)}px`;
  for (const { place, label } of ticks) {
    const text = document.createElement('span');
    text.textContent = label;
    text.style.bottom = `${100 * place}%`;
    bar.append(text);
  }
  part('title').textContent = title;
  part('scale').hidden = false;
}

let wanted = 0;
let shown = -1;
let drawing = false;
async function show(frame) {
  wanted = frame;
  slider.value = frame;
  const number = told.numbers[frame];
  const seconds = told.fps ? `, ${(number / told.fps).toFixed(2)} s` : '';
  part('counter').textContent = `frame ${number} / ${told.n_frames - 1}${seconds}`;
  if (drawing) return; // the drawing in progress continues with the latest requested frame
  drawing = true;
  while (shown !== wanted) {
    shown = wanted;
    await K3DInstance.setTime(shown);
  }
  drawing = false;
}

let begun = null; // when frame 0 was due, in milliseconds; null while paused
function milliseconds() {
  const step = last ? told.numbers[1] - told.numbers[0] : 1;
  return 1000 * step / ((told.fps || usualRate) * Number(speed.value));
}
function tick(now) {
  if (begun === null) return;
  const frame = Math.floor(Math.max(0, now - begun) / milliseconds()) % (last + 1);
  if (frame !== wanted) show(frame);
  requestAnimationFrame(tick);
}
function start() {
  begun = performance.now() - wanted * milliseconds();
  play.textContent = 'Pause';
  requestAnimationFrame(tick);
}
function stop() {
  begun = null;
  play.textContent = 'Play';
}
function go(frame) {
  stop();
  show(Math.min(Math.max(frame, 0), last));
}

play.onclick = () => (begun === null ? start() : stop());
slider.oninput = () => go(Number(slider.value));
speed.onchange = () => { if (begun !== null) begun = performance.now() - wanted * milliseconds(); };
document.addEventListener('keydown', (event) => {
  if (event.target === speed || last === 0) return;
  const actions = {
    ' ': play.onclick, ArrowLeft: () => go(wanted - 1), ArrowRight: () => go(wanted + 1),
  };
  if (!(event.key in actions)) return;
  event.preventDefault(); // otherwise a focused button or slider would also react
  actions[event.key]();
});
show(0);
