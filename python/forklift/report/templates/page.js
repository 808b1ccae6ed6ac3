"use strict";
const blocks = JSON.parse(document.getElementById("data").textContent);
const root = document.documentElement;
const places = [...document.querySelectorAll(".plot")];
const touch = matchMedia("(pointer: coarse)").matches;
const options = { responsive: true, displaylogo: false, displayModeBar: false, doubleClick: "reset" };
const colour = name => getComputedStyle(root).getPropertyValue("--" + name).trim();

// Colours are names until they are drawn: "@after" is whatever --after is now.
function coloured(value) {
  if (typeof value === "string") return /^@[a-z]+$/.test(value) ? colour(value.slice(1)) : value;
  if (Array.isArray(value)) return value.map(coloured);
  if (value && typeof value === "object")
    return Object.fromEntries(Object.entries(value).map(([key, one]) => [key, coloured(one)]));
  return value;
}

function axis(own = {}) {
  return {
    color: colour("soft"), gridcolor: colour("line"), zerolinecolor: colour("soft"), zerolinewidth: 1, automargin: true,
    exponentformat: "power", ticks: "outside", ticklen: 4, tickcolor: colour("line"), ...own,
    ...(own.title ? { title: { standoff: 6, ...own.title } } : {}),
  };
}

function framed(own = {}) {
  const layout = {
    showlegend: false, hovermode: "x unified", dragmode: touch ? false : "zoom",
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: getComputedStyle(document.body).fontFamily, size: 12, color: colour("ink") },
    hoverlabel: { bgcolor: colour("panel"), bordercolor: colour("soft"), font: { color: colour("ink") } },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { size: 11 } },
    ...own, margin: { l: 56, r: 10, t: own.showlegend ? 40 : 8, b: 44, ...own.margin },
  };
  if (!Object.keys(layout).some(key => key.startsWith("yaxis"))) layout.yaxis = {};
  layout.xaxis ??= {};
  for (const key of Object.keys(layout)) if (/^[xy]axis\d*$/.test(key)) layout[key] = axis(layout[key]);
  return layout;
}

function drawFigure(place, block) {
  const panel = block.panels[place.chosen ?? 0];
  return Plotly.react(place, coloured(panel.data), framed(coloured(panel.layout)), options);
}

// One recording, one signal: measured and simulated, their difference, what drove it; one time for all.
const united = (name, unit) => unit ? `${name} [${unit}]` : name;
// A sample without neighbours is no line.
const lonely = y => y.some((value, k) => value !== null && (y[k - 1] ?? null) === null && (y[k + 1] ?? null) === null);
const widths = { measured: 3.5, before: 2, after: 1.8, simulated: 1.8 };

function drawRecording(place, block) {
  const recording = block.recordings[place.recording], signal = recording.signals[place.signal];
  const { x, ...curves } = signal.curves;
  const shown = name => ({ color: colour(name), width: widths[name], dash: name === "before" ? "dot" : "solid" });
  const curve = (name, colours, y, more) => ({
    type: "scatter", name, x, y, line: shown(colours), ...(lonely(y) ? { mode: "lines+markers", marker: { size: 4 } } : { mode: "lines" }), ...more,
  });
  const data = Object.entries(curves).map(([name, y]) =>
    curve(name, name, y, { opacity: name === "measured" ? 0.75 : 1, hovertemplate: "%{y:.4g}" }));
  for (const name of block.sides) if (curves[name]) {
    const off = curves[name].map((value, k) => value === null || curves.measured[k] === null ? null : value - curves.measured[k]);
    data.push(curve(`${name} less measured`, name, off, { yaxis: "y2", hovertemplate: "%{y:.3g}" }));
  }
  const drive = recording.drives[place.drive ?? 0], { x: time, ...inputs } = drive?.curves ?? {};
  Object.entries(inputs).forEach(([name, y], k) => data.push({
    type: "scatter", mode: "lines", name, x: time, y, yaxis: "y3", hovertemplate: `%{y:.3g} ${drive.unit}`,
    line: { color: colour("soft"), width: 1.5, dash: k ? "dash" : "solid", shape: drive.held ? "hv" : "linear" },
  }));
  const title = text => ({ text, font: { size: 11 } });
  const layout = framed({
    xaxis: { title: title("Time [s]"), anchor: drive ? "y3" : "y", ...(place.range ? { range: place.range } : {}) },
    yaxis: { title: title(united(signal.title.split(" of the ")[0], signal.unit)), domain: [0.17, 0.42], nticks: 5 },
    yaxis2: { title: title(united("simulated less measured", signal.unit)), domain: [0.46, 1], nticks: 7 },
    ...(drive ? { yaxis3: { title: title(united(drive.title.replace(", ", ",<br>"), drive.unit)), domain: [0, 0.13], nticks: 3 } } : {}),
    hoversubplots: "axis",
    shapes: signal.band ? [{
      type: "rect", xref: "paper", x0: 0, x1: 1, yref: "y2", y0: signal.band[0], y1: signal.band[1],
      fillcolor: colour("noise"), line: { width: 0 }, layer: "below",
    }] : [],
  });
  const frame = place.closest("figure");
  frame.querySelector(".conditions").textContent = [`${recording.group}: ${recording.title}`, recording.note, signal.note].filter(Boolean).join(" · ");
  const swatch = frame.querySelector(".legend .noise");
  if (swatch) swatch.hidden = !signal.band;
  place.setAttribute("aria-label", `${signal.title}, ${recording.title}`);
  return Plotly.react(place, data, layout, options);
}

function draw(place) {
  const block = blocks[place.dataset.place];
  (block.recordings ? drawRecording : drawFigure)(place, block);
  place.dataset.drawn = "yes";
}

const redraw = () => places.filter(place => place.dataset.drawn).forEach(draw);

function fill(select, names, groups) {
  let into = select, last;
  names.forEach((name, k) => {
    if (groups && groups[k] !== last) {
      into = select.appendChild(document.createElement("optgroup"));
      into.label = last = groups[k];
    }
    into.append(new Option(name, k));
  });
}

function explore(place, block) {
  const frame = place.closest("figure");
  const [recording, signal] = ["recording", "signal"].map(name => frame.querySelector(`[data-choose=${name}]`));
  const end = () => block.recordings[place.recording].signals[place.signal].curves.x.at(-1);
  const begin = () => block.recordings[place.recording].signals[place.signal].curves.x[0];
  const drive = frame.querySelector("[data-choose=drive]");
  if (drive) {
    fill(drive, block.recordings[0].drives.map(one => one.title));
    drive.addEventListener("change", () => { keep(); place.drive = Number(drive.value); draw(place); });
  }
  fill(recording, block.recordings.map(one => one.title), block.recordings.map(one => one.group));
  function choose(k, wanted) {
    const signals = block.recordings[k].signals.map(one => one.title);
    place.recording = k;
    place.signal = Math.max(0, typeof wanted === "number" ? wanted : signals.indexOf(wanted));
    signal.replaceChildren();
    fill(signal, signals);
    recording.value = k;
    signal.value = place.signal;
    place.range = null;
  }
  const title = () => block.recordings[place.recording].signals[place.signal].title;
  choose(...block.first);
  recording.addEventListener("change", () => { choose(Number(recording.value), title()); draw(place); });
  signal.addEventListener("change", () => { keep(); place.signal = Number(signal.value); draw(place); });
  for (const button of frame.querySelectorAll("[data-step]")) button.addEventListener("click", () => {
    const n = block.recordings.length;
    choose((place.recording + Number(button.dataset.step) + n) % n, title());
    draw(place);
  });
  const now = () => place._fullLayout ? [...place._fullLayout.xaxis.range] : [begin(), end()];
  const keep = () => { place.range = place._fullLayout && !place._fullLayout.xaxis.autorange ? now() : null; };
  const moves = {
    in: ([a, b]) => [a + (b - a) / 4, b - (b - a) / 4], out: ([a, b]) => [a - (b - a) / 2, b + (b - a) / 2],
    left: ([a, b]) => [a - (b - a) / 4, b - (b - a) / 4], right: ([a, b]) => [a + (b - a) / 4, b + (b - a) / 4],
  };
  for (const button of frame.querySelectorAll("[data-zoom]")) button.addEventListener("click", () => {
    if (!place.dataset.drawn) draw(place);
    const move = moves[button.dataset.zoom];
    const wanted = move && move(now());
    if (!wanted || (wanted[0] <= begin() && wanted[1] >= end())) Plotly.relayout(place, { "xaxis.autorange": true });
    else Plotly.relayout(place, { "xaxis.range": wanted });
  });
}

for (const place of places) {
  const block = blocks[place.dataset.place];
  place.setAttribute("role", "img");
  if (block.recordings) { explore(place, block); continue; }
  place.setAttribute("aria-label", block.title);
  const select = place.closest("figure").querySelector("[data-choose=panel]");
  if (!select) continue;
  fill(select, block.panels.map(panel => panel.label));
  place.chosen = 0;
  const chosen = place.closest("figure").querySelector(".chosen span");  // on paper
  select.addEventListener("change", () => {
    place.chosen = Number(select.value);
    chosen.textContent = block.panels[place.chosen].label;
    draw(place);
  });
}

// What is scrolled sideways can be reached by the keyboard, and nothing else need be.
const reachable = new ResizeObserver(seen => {
  for (const { target } of seen) {
    const wider = target.scrollWidth > target.clientWidth;
    target.classList.toggle("wider", wider);
    if (wider) target.tabIndex = 0;
    else target.removeAttribute("tabindex");
    const marked = target.querySelector(".marked");
    if (wider && marked && !target.dataset.placed) {  // what is marked comes into view
      const own = target.getBoundingClientRect(), at = marked.getBoundingClientRect();
      target.scrollLeft += at.left + at.width / 2 - own.left - own.width / 2;
      target.dataset.placed = "1";
    }
  }
});
document.querySelectorAll(".scroll").forEach(one => reachable.observe(one));

// Figures are drawn when they come near.
if ("IntersectionObserver" in window) {
  const watch = new IntersectionObserver(seen => {
    for (const one of seen) if (one.isIntersecting) { watch.unobserve(one.target); draw(one.target); }
  }, { rootMargin: "600px" });
  places.forEach(place => watch.observe(place));
} else {
  places.forEach(draw);
}

// Light, dark, or as the system has it.
const themes = ["system", "light", "dark"], button = document.getElementById("theme");
function paint(theme) {
  if (theme === "system") delete root.dataset.theme;
  else root.dataset.theme = theme;
  button.textContent = `Colours: ${theme}`;
}
let theme = "system";
try { theme = themes.includes(localStorage.getItem("forklift-theme")) ? localStorage.getItem("forklift-theme") : theme; } catch { /* no storage for files */ }
paint(theme);
button.addEventListener("click", () => {
  theme = themes[(themes.indexOf(theme) + 1) % themes.length];
  try { localStorage.setItem("forklift-theme", theme); } catch { /* likewise */ }
  paint(theme);
  redraw();
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);

// On paper: light colours, every figure, as wide as the paper, and every table that is folded on the screen.
const folded = new Set();
const PAPER_PX = 690, PAPER_HIGH_PX = 470;
function onPaper() {
  paint("light");
  for (const one of document.querySelectorAll("details:not([open])")) {
    folded.add(one);
    one.open = true;
  }
  for (const place of places) {
    draw(place);
    const high = blocks[place.dataset.place].recordings ? { height: PAPER_HIGH_PX } : {};
    const crowded = blocks[place.dataset.place].least_px > PAPER_PX;
    const upright = Object.keys(place.layout).filter(key => crowded && /^xaxis\d*$/.test(key)).map(key => [`${key}.tickangle`, -90]);
    Plotly.relayout(place, { width: PAPER_PX, ...high, ...Object.fromEntries(upright), autosize: false });
  }
}
function onScreen() {
  paint(theme);
  for (const one of folded) one.open = false;
  folded.clear();
  for (const place of places) Plotly.relayout(place, { width: null, height: null, autosize: true });
  redraw();
}
addEventListener("beforeprint", onPaper);
addEventListener("afterprint", onScreen);
matchMedia("print").addEventListener("change", media => media.matches ? onPaper() : onScreen());
