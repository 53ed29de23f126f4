// The text and the controls of the page. The snapshot runs data.js, panes.js, camera.js and this
// script as one, when it is loaded. `told` holds the data from player.py.

const part = (name) => document.getElementById(`dynmesh-${name}`);
const play = part('play'), slider = part('frame'), speed = part('speed'), choice = part('colour');
const last = told.names.length - 1;
const usualRate = 25;

document.title = told.title;
part('name').textContent = told.title;
part('note').textContent = told.note;
slider.max = last;
slider.disabled = play.disabled = last === 0;
if (told.fps === null) {
  speed.title = `1 × is ${usualRate} frames per second; the file states no rate`;
}
for (const { name } of told.colours) choice.add(new Option(name, name));
choice.parentElement.hidden = told.colours.length === 1;

for (const colour of told.colours) {
  if (colour.values) colour.places = await unpackedBytes(colour.values, size);
}
const panes = await panesOf(told.panes, part('panes'));
const camera = new Camera(panes, part('panes'));

function showScale({ scale }) {
  part('scale').hidden = !scale;
  const bar = part('bar');
  bar.replaceChildren();
  if (!scale) return;
  const { title, colours, ticks } = scale;
  const step = 100 / colours.length;
  const stops = colours.map((colour, i) => `${colour} ${i * step}% ${(i + 1) * step}%`);
  bar.style.setProperty('--stops', stops.join());
  bar.style.setProperty('--height', `${Math.max(Math.min(260, 36 * colours.length), 20 * ticks.length)}px`);
  const longest = Math.max(...ticks.map(({ label }) => label.length));
  part('scale').style.setProperty('--width', `${longest + 7}ch`);
  for (const { position, label } of ticks) {
    const text = document.createElement('span');
    text.textContent = label;
    text.style.bottom = `${100 * position}%`;
    const index = Math.min(Math.floor(position * colours.length), colours.length - 1);
    text.style.setProperty('--colour', colours[index]);
    bar.append(text);
  }
  part('title').textContent = title;
}

// A line of colours under the slider, which says how good the frames are that each shown one stands
// for.
part('quality').hidden = part('verdict').hidden = !told.verdicts.length;
for (const [quality, sentence] of told.verdicts) {
  const mark = document.createElement('span');
  mark.className = quality;
  mark.title = sentence;
  part('quality').append(mark);
}
const marks = part('quality').children;
part('quality').onclick = ({ target }) => {
  const frame = [...marks].indexOf(target);
  if (frame >= 0) go(frame);
};
function showVerdict(frame, before) {
  marks[before].classList.remove('shown');
  marks[frame].classList.add('shown');
  part('verdict').textContent = marks[frame].title;
}

let colour = told.colours.find(({ name }) => name === told.colour);
let wanted = told.first; // the index of a shown frame
let isDrawing = false;
async function draw() {
  if (isDrawing) return; // the drawing in progress continues with what is wanted last
  isDrawing = true;
  const state = part('panes').dataset;
  for (let next; (next = `${wanted} ${colour.name}`) !== state.drawn; state.drawn = next) {
    await Promise.all(panes.map((pane) => pane.draw(wanted, colour)));
  }
  isDrawing = false;
}
function show(frame) {
  if (marks.length) showVerdict(frame, wanted);
  wanted = frame;
  slider.value = frame;
  camera.follow(frame);
  const seconds = told.fps ? `, ${(frame * told.step / told.fps).toFixed(2)} s` : '';
  part('counter').textContent = `${told.names[frame]} / ${told.last}${told.clock ? '' : seconds}`;
  draw();
}
function paint(index) {
  colour = told.colours[index];
  choice.value = colour.name;
  showScale(colour);
  draw();
}

let begun = null; // when the first frame was due, in milliseconds; null while paused
function milliseconds() {
  return 1000 * told.step / ((told.fps || usualRate) * Number(speed.value));
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
function help(isShown) {
  part('help').hidden = !isShown;
}

play.onclick = () => (begun === null ? start() : stop());
slider.oninput = () => go(Number(slider.value));
speed.onchange = () => {
  if (begun !== null) start();
  speed.blur(); // so that keys reach the page again
};
choice.onchange = () => { paint(choice.selectedIndex); choice.blur(); };
part('reset').onclick = () => camera.reset();
part('ask').onclick = () => help(part('help').hidden);
part('help').onclick = () => help(false);

const count = told.colours.length;
const turn = (by) => paint((choice.selectedIndex + by + count) % count);
const keys = {
  c: () => turn(1), C: () => turn(-1), r: camera.reset.bind(camera), f: () => camera.toggle(wanted),
  '?': part('ask').onclick, Escape: () => help(false),
};
if (last) {
  Object.assign(keys, {
    ' ': play.onclick, Home: () => go(0), End: () => go(last),
    ArrowLeft: () => go(wanted - 1), ArrowRight: () => go(wanted + 1),
  });
}
told.colours.forEach((_, i) => { keys[i + 1] = () => paint(i); });
document.addEventListener('keydown', (event) => {
  if (event.target.tagName === 'SELECT' || event.ctrlKey || event.altKey || event.metaKey) return;
  if (!(event.key in keys)) return;
  event.preventDefault(); // otherwise a focused button or slider would also react
  keys[event.key]();
});

const isDark = matchMedia('(prefers-color-scheme: dark)');
function shade() {
  for (const { plot } of panes) plot.setClearColor(isDark.matches ? 0x1e2129 : 0xffffff);
}
isDark.onchange = shade;
shade();
show(told.first);
paint(told.colours.indexOf(colour));
if (last && (told.plays || location.hash === '#play')) start(); // embedded in another page, it may play at once
