// The live dashboard: what the rig says (server-sent events) is shown; what the viewer does is posted.
// The page keeps no state of its own beyond the last minute of plotted samples.
import "./style.css";
import { display, drawing, format, h, measured } from "./dom.js";
import { colour } from "./driveline.js";
import { plotStack } from "./plots.js";

const page = document.getElementById("page");
const token = new URLSearchParams(location.search).get("token");
const withToken = (path) => (token ? `${path}${path.includes("?") ? "&" : "?"}token=${encodeURIComponent(token)}` : path);
const window_s = 20;

const notice = h("div", { class: "banner bad", role: "alert", hidden: true });
page.append(notice);
start().catch((error) => say(`The rig does not answer: ${error.message}`));

function say(text) { notice.textContent = text; notice.hidden = !text; }

async function start() {
  const model = await (await fetch(withToken("/api/model"))).json();
  document.title = `${model.name} – shiftrig`;
  const index = new Map(model.signals.map((signal, i) => [signal.name, i]));
  const view = layout(model, index);
  listen(model, index, view);
}

/** Tell the rig; a refusal is shown, not swallowed. */
async function post(path, body) {
  try {
    const answer = await fetch(withToken(path), { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
    if (!answer.ok) say(`${path}: ${await answer.text()}`);
    else say("");
    return answer.ok;
  } catch (error) { say(`The rig does not answer: ${error.message}`); return false; }
}

function layout(model, index) {
  const banner = h("div", { class: "banner fair", role: "status", hidden: true });
  const gauges = new Map(model.gauges.map((g) => [g.signal, h("div", { class: "gauge" }, h("div", { class: "faint" }, g.label), h("div", { class: "big", "data-signal": g.signal }, "–"))]));
  const svg = drawing(model.driveline_svg);
  const plots = h("div");
  const events = h("div", { class: "log panel mono", tabindex: 0, role: "log", "aria-label": "Events" });
  const card = h("div", { class: "panel", "aria-live": "polite" }, h("p", { class: "faint" }, "No shift yet."));
  const health = h("p", { class: "mono faint", "data-role": "health" }, "");
  const driver = panel("Driver", model.driver.map((c) => control(c)));
  page.append(
    h("header", { class: "row" }, h("h1", {}, model.name), h("span", { class: "faint hide-narrow" }, model.identity)),
    banner, h("div", { class: "gauges" }, [...gauges.values()]), transport(),
    h("h2", {}, "Driveline"), h("div", { class: "driveline scroll panel" }, svg),
    h("div", { class: "grid" }, driver, panel("Surroundings", model.environment.map((c) => control(c))), faults(model.faults), parameters(model.parameters)),
    h("h2", {}, "Last 20 seconds"), plots,
    h("div", { class: "grid" }, h("div", {}, h("h2", {}, "Last shift"), card), h("div", {}, h("h2", {}, "Events"), events)),
    h("h2", {}, "Loop"), health);
  const groups = model.plots.map((group) => ({ title: group.title, height: 170, columns: group.signals.filter((n) => index.has(n)).map((n) => ({ name: n, label: n.replace(/^(mass|clutch|shaft|body|sensor)\./, ""), unit: model.signals[index.get(n)].unit, values: [] })) }));
  const stack = plotStack(plots, { t: [], groups, live: true });
  return { banner, gauges, svg, stack, events, card, health, groups };
}

function panel(title, content) { return h("div", { class: "panel" }, h("h3", {}, title), content); }

/** One slider or choice bound to one signal of the rig. */
function control(c) {
  if (c.options) {
    const buttons = c.options.map((o) => h("button", { "aria-pressed": o.value === c.value ? "true" : "false", "data-control": c.signal, "data-value": o.value, onclick: async () => { if (await post("/api/input", { signal: c.signal, value: o.value })) buttons.forEach((b) => b.setAttribute("aria-pressed", b === buttons[c.options.indexOf(o)] ? "true" : "false")); } }, o.label));
    return h("div", { role: "group", "aria-label": c.label }, h("div", {}, c.label), h("div", { class: "row" }, buttons));
  }
  const value = h("span", { class: "value" }, format(c.value, c.digits));
  const slider = h("input", { type: "range", min: c.minimum, max: c.maximum, step: c.step, value: c.value, "data-control": c.signal, oninput: () => { value.textContent = format(Number(slider.value), c.digits); post("/api/input", { signal: c.signal, value: Number(slider.value) }); } });
  return h("label", { class: "control" }, c.label, c.unit ? ` [${c.unit}]` : "", value, slider);
}

function faults(list) {
  return panel("Faults", h("div", { class: "faults" }, list.map((f) => {
    const button = h("button", { class: "fault", "aria-pressed": "false", "data-fault": f.name, onclick: async () => { const on = button.getAttribute("aria-pressed") !== "true"; if (await post("/api/fault", { name: f.name, active: on })) button.setAttribute("aria-pressed", String(on)); } }, f.label);
    return button;
  })));
}

function parameters(list) {
  if (!list.length) return panel("Parameters", h("p", { class: "faint" }, "None in this model."));
  const devices = [...new Set(list.map((p) => p.device))];
  const field = (p) => {
    const input = h("input", { type: "number", value: Number(p.value.toPrecision(6)), step: "any", "aria-label": `${p.device} ${p.label}`, "data-parameter": p.name });
    return h("div", { class: "row parameter" }, h("span", {}, p.label, p.unit ? ` [${p.unit}]` : ""), input, h("button", { onclick: () => post("/api/parameter", { name: p.name, value: Number(input.value) }) }, "Set"));
  };
  return panel("Parameters", devices.map((device) => h("details", {}, h("summary", {}, device), list.filter((p) => p.device === device).map(field))));
}

function transport() {
  const pause = h("button", { "aria-pressed": "false", "data-role": "pause", onclick: async () => { const on = pause.getAttribute("aria-pressed") !== "true"; if (await post("/api/pause", { paused: on })) { pause.setAttribute("aria-pressed", String(on)); step.disabled = !on; } } }, "Pause");
  const step = h("button", { disabled: true, "data-role": "step", onclick: () => post("/api/step", { ticks: 1 }) }, "Step");
  const speed = h("select", { "aria-label": "Speed of simulated time", onchange: () => post("/api/speed", { factor: Number(speed.value) }) }, [1, 0.5, 0.2, 0.1, 0.02].map((f) => h("option", { value: f }, f === 1 ? "real time" : `${f} ×`)));
  const record = h("button", { "aria-pressed": "false", "data-role": "record", onclick: async () => { const on = record.getAttribute("aria-pressed") !== "true"; if (await post("/api/record", { active: on })) record.setAttribute("aria-pressed", String(on)); } }, "Record");
  const download = h("a", { href: withToken("/api/recording"), download: "shiftrig.lcm", "data-role": "download" }, "Download recording");
  return h("div", { class: "row panel", role: "toolbar", "aria-label": "Run" }, pause, step, speed, record, download);
}

function listen(model, index, view) {
  const source = new EventSource(withToken("/api/live"));
  const time = [], columns = view.groups.flatMap((g) => g.columns.map((c) => ({ at: index.get(c.name), values: [] })));
  let lastPlot = 0;
  source.onopen = () => say("");
  source.onerror = () => say(source.readyState === EventSource.CLOSED ? "The rig has ended or refused the connection." : "Connection to the rig lost; trying again. What you see is old.");
  source.addEventListener("sample", (message) => {
    const sample = JSON.parse(message.data);
    if (time.length && sample.t < time[time.length - 1]) { time.length = 0; columns.forEach((c) => (c.values.length = 0)); }
    time.push(sample.t);
    columns.forEach((c) => c.values.push(sample.v[c.at]));
    while (time.length && time[0] < sample.t - window_s) { time.shift(); columns.forEach((c) => c.values.shift()); }
    for (const g of model.gauges) {
      const shown = g.words ? null : display(g.unit, g.signal), value = sample.v[index.get(g.signal)];
      view.gauges.get(g.signal).querySelector(".big").textContent = g.words ? (g.words[String(Math.round(value))] ?? "–") : `${format(value * shown.factor, shown.digits)} ${shown.unit}`;
    }
    colour(view.svg, (name) => (index.has(name) ? { value: sample.v[index.get(name)], unit: model.signals[index.get(name)].unit } : null));
    view.health.textContent = sample.health;
    view.banner.hidden = !sample.banner;
    view.banner.textContent = sample.banner ?? "";
    if (performance.now() - lastPlot > 120) { view.stack.update(time, columns.map((c) => c.values)); lastPlot = performance.now(); }
  });
  source.addEventListener("change", (message) => {
    view.events.prepend(h("div", {}, JSON.parse(message.data).text));
    while (view.events.childElementCount > 200) view.events.lastElementChild.remove();
  });
  source.addEventListener("shift", (message) => {
    const s = JSON.parse(message.data);
    view.card.replaceChildren(h("p", {}, h("strong", {}, `${s.from} → ${s.to} `), h("span", { class: `verdict ${s.verdict}` }, s.completed ? s.verdict : "not completed")),
      h("table", {}, h("tbody", {}, s.metrics.map((m) => h("tr", {}, h("td", {}, m.label), h("td", { class: "number" }, measured(m)), h("td", { class: `verdict ${m.verdict}` }, m.verdict))))));
  });
}
