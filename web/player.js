// The player of a report: a robot in three dimensions and its signals, on one axis of time.
// Reads what `gaitshift.report` wrote into the page; see there for the meaning of each entry.
import { scene } from "./scene.js";
import { charts } from "./charts.js";
import { themed } from "./theme.js";
import { unpack } from "./unpack.js";

const walks = document.querySelectorAll("script[data-walk]");
const which = Math.min(Number(location.hash.slice(1)) || 0, walks.length - 1);
const run = JSON.parse(walks[which].textContent);
const data = unpack(run);
const state = { time: 0, plays: false, pace: 1, end: data.time[data.time.length - 1] };
const at = () => Math.min(Math.round(state.time / data.period), data.time.length - 1);

const slider = document.getElementById("time");
const clock = document.getElementById("clock");
const play = document.getElementById("play");
const badge = document.getElementById("gait");
slider.max = state.end;

const view = scene(document.getElementById("scene"), data);
const plots = charts(document.getElementById("charts"), data, seek);

const course = document.getElementById("course");
const learning = course && charts(course, unpack(JSON.parse(document.getElementById("progress").textContent)));
const choice = document.getElementById("walk");
if (choice) {
  choice.value = which;
  choice.addEventListener("change", () => {
    location.hash = choice.value;
    location.reload(); // another walk is another page
  });
}

function seek(time) {
  state.time = Math.min(Math.max(time, 0), state.end);
  show();
}

function show() {
  const i = at();
  const gait = data.gaits[data.gait[i]];
  slider.value = state.time;
  clock.textContent = `${state.time.toFixed(2)} s`;
  badge.textContent = gait.title;
  badge.style.background = gait.colour;
  view.show(i);
  plots.show(state.time);
}

function setPlaying(plays) {
  state.plays = plays;
  play.textContent = plays ? "Pause" : "Play";
  play.setAttribute("aria-pressed", plays);
}

play.addEventListener("click", () => {
  if (state.time >= state.end) state.time = 0;
  setPlaying(!state.plays);
});
slider.addEventListener("input", () => seek(Number(slider.value)));
document.getElementById("pace").addEventListener("change", (e) => (state.pace = Number(e.target.value)));
document.getElementById("follow").addEventListener("change", (e) => view.follow(e.target.checked));
document.getElementById("whole").addEventListener("click", () => plots.whole());
for (const row of document.querySelectorAll("[data-seek]"))
  row.addEventListener("click", () => seek(Number(row.dataset.seek)));
document.addEventListener("keydown", (e) => {
  if (e.target.matches("input, select, button")) return;
  if (e.key === " ") (e.preventDefault(), setPlaying(!state.plays));
  if (e.key === "ArrowRight") seek(state.time + 0.1);
  if (e.key === "ArrowLeft") seek(state.time - 0.1);
});
function recolour() {
  view.recolour();
  plots.show(state.time);
  if (learning) learning.show(null);
}
themed(recolour);

let before = performance.now();
function tick(now) {
  const step = Math.min(now - before, 100) / 1000;
  before = now;
  if (state.plays) {
    state.time = Math.min(state.time + step * state.pace, state.end);
    if (state.time >= state.end) setPlaying(false);
    show();
  } else view.render();
  requestAnimationFrame(tick);
}
show();
requestAnimationFrame(tick);
window.gaitshift = { state, seek, view }; // for tests and the curious
