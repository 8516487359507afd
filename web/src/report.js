// The report of one recording: what happened, how good each shift was, and pictures to find out why.
// Everything stands in the page itself (the JSON in #data); nothing is fetched.
import "./style.css";
import { drawing, format, h, measured } from "./dom.js";
import { colour } from "./driveline.js";
import { plotStack } from "./plots.js";

const data = JSON.parse(document.getElementById("data").textContent);
const page = document.getElementById("page");

if (data.placeholder) page.append(h("p", {}, "This is the empty frame of a report; `shiftrig report RECORDING -o report.html` fills it."));
else build();

function build() {
  document.title = `${data.title} – shiftrig report`;
  const series = decode(data.series);
  page.append(heading(), summary(), navigation());
  page.append(section("shifts", "Shifts", scorecard(data.shifts)));
  const plots = section("plots", "Plots");
  page.append(plots);
  page.append(section("driveline", "Driveline", driveline(series)));
  page.append(section("energy", "Energy balance", energy(data.energy)));
  page.append(section("events", "What changed its state", events(data.events)));
  page.append(section("loop", "Loop and bus", loop(data.loop), bus(data.bus)));
  page.append(section("identity", "Model and build", identity()));
  drawPlots(plots, series);
}

function section(id, title, ...content) { return h("section", { id }, h("h2", {}, title), ...content); }

function heading() {
  return h("header", {}, h("h1", {}, data.title),
    h("p", { class: "faint" }, [data.scenario, `${format(data.duration_s, 2)} s simulated`, data.kernel && `kernel ${data.kernel}`].filter(Boolean).join(" · ")));
}

function summary() {
  const shifts = data.shifts.length, completed = data.shifts.filter((s) => s.completed).length;
  const worst = data.shifts.some((s) => s.verdict === "reject") ? "reject" : data.shifts.some((s) => s.verdict === "acceptable") ? "acceptable" : "good";
  if (!shifts) return h("p", { class: "panel" }, "No shift was commanded in this recording.");
  return h("p", { class: "panel" }, h("span", { class: `verdict ${worst}` }, worst.toUpperCase()), ` – ${completed} of ${shifts} shifts completed.`);
}

function navigation() {
  const places = [["shifts", "Shifts"], ["plots", "Plots"], ["driveline", "Driveline"], ["energy", "Energy"], ["events", "Events"], ["loop", "Loop"], ["identity", "Identity"]];
  return h("nav", { class: "no-print", "aria-label": "Sections" }, places.map(([id, text]) => h("a", { href: `#${id}` }, text)));
}

function scorecard(shifts) {
  return shifts.map((shift, index) => h("div", { class: "panel" },
    h("div", { class: "row" },
      h("h3", {}, `${index + 1}. ${shift.from} → ${shift.to}`),
      h("span", { class: "faint" }, `${shift.kind}, commanded at ${format(shift.command_s, 3)} s`),
      h("span", { class: `verdict ${shift.verdict}` }, shift.completed ? shift.verdict : `not completed: ${shift.end}`),
      h("button", { class: "no-print", onclick: () => window.shiftrigPlots?.zoom(shift.command_s - 0.5, shift.end_s + 1) }, "Show in plots")),
    shift.phases.length ? h("p", { class: "faint" }, shift.phases.map((p) => `${p.name} ${format(p.to - p.from, 3)} s`).join(" · ")) : null,
    h("div", { class: "scroll" }, h("table", { class: "scorecard" },
      h("thead", {}, h("tr", {}, h("th", {}, "Metric"), h("th", { class: "number" }, "Value"), h("th", { class: "number" }, "Good"), h("th", { class: "number" }, "Reject"), h("th", {}, "Verdict"))),
      h("tbody", {}, shift.metrics.map((m) => h("tr", {},
        h("td", {}, m.label), h("td", { class: "number" }, measured(m)),
        h("td", { class: "number" }, limit(m.good)), h("td", { class: "number" }, limit(m.reject)),
        h("td", { class: `verdict ${m.verdict}` }, m.verdict))))))));
}

function limit(value) { return value === null || value === undefined ? "" : `${value}`; }

function drawPlots(parent, series) {
  const bands = data.shifts.flatMap((s) => (s.phases.length ? s.phases.map((p) => ({ from: p.from, to: p.to, label: p.name })) : [{ from: s.command_s, to: s.end_s, label: `${s.from}→${s.to}` }]));
  const marks = data.events.length > 400 ? [] : data.events.map((e) => ({ t: e.t, text: e.text }));
  const controls = h("div", { class: "row no-print" },
    h("button", { onclick: () => plots.reset() }, "Whole run"),
    data.shifts.map((s, i) => h("button", { onclick: () => plots.zoom(s.command_s - 0.5, s.end_s + 1) }, `Shift ${i + 1}: ${s.from}→${s.to}`)),
    h("span", { class: "faint" }, "Drag to zoom, double-click to see the whole run."));
  parent.append(controls);
  const groups = data.groups.map((group) => ({ title: group.title, columns: group.columns.map((name) => series.columns.get(name)).filter(Boolean) }));
  const plots = plotStack(parent, { t: series.t, groups, bands, marks, onCursor: (t) => window.shiftrigInstant?.(t) });
  window.shiftrigPlots = plots;
}

/** The driveline with each device's state in the instant under the cursor. */
function driveline(series) {
  const svg = drawing(data.driveline_svg);
  const clock = h("output", { class: "mono" }, "");
  const slider = h("input", { type: "range", min: 0, max: series.t.length - 1, value: 0, step: 1, "aria-label": "Instant of the driveline picture", oninput: () => show(Number(slider.value)) });
  const show = (i) => {
    clock.textContent = `t = ${format(series.t[i], 3)} s`;
    slider.value = i;
    colour(svg, (name) => { const column = series.columns.get(name); return column ? { value: column.values[i], unit: column.unit } : null; });
  };
  window.shiftrigInstant = (t) => show(nearest(series.t, t));
  queueMicrotask(() => show(0));
  return h("div", {}, h("p", { class: "no-print" }, clock, slider), h("div", { class: "driveline scroll panel" }, svg));
}

function energy(balance) {
  const rows = [["Put in by sources", balance.input_j], ["Stored (change)", balance.stored_change_j], ...Object.entries(balance.dissipated_j).map(([name, v]) => [`Dissipated: ${name}`, v]), ["Dissipated, all", balance.dissipated_total_j], ["Defect (should be nothing)", balance.defect_j]];
  return h("div", { class: "scroll" }, h("table", {}, h("tbody", {}, rows.map(([name, v]) => h("tr", {}, h("td", {}, name), h("td", { class: "number" }, `${format(v, Math.abs(v) < 10 ? 4 : 0)} J`))))));
}

function events(list) {
  if (!list.length) return h("p", {}, "Nothing changed its state.");
  return h("div", { class: "log panel mono", tabindex: 0, role: "log", "aria-label": "Events" }, list.map((e) => h("div", {}, e.text)));
}

function loop(report) {
  if (!report || !Object.keys(report).length) return h("p", { class: "faint" }, "Not paced by the wall clock: no latencies.");
  return h("div", { class: "scroll" }, h("table", {}, h("tbody", {}, Object.entries(report).map(([name, v]) => h("tr", {}, h("td", {}, name.replaceAll("_", " ")), h("td", { class: "number" }, typeof v === "number" ? format(v, Number.isInteger(v) ? 0 : 3) : v))))));
}

function bus(list) {
  if (!list || !list.length) return null;
  return h("div", { class: "scroll" }, h("h3", {}, "Messages"), h("table", {}, h("tbody", {}, list.map((m) => h("tr", {}, h("td", {}, m.message), h("td", {}, m.text))))));
}

function identity() {
  return h("div", {}, h("table", {}, h("tbody", {}, Object.entries(data.identity).map(([name, v]) => h("tr", {}, h("td", {}, name), h("td", { class: "mono" }, String(v)))))),
    data.model_text ? h("details", {}, h("summary", {}, "Model as run"), h("pre", { class: "mono scroll" }, data.model_text)) : null);
}

/** Columns come as base64 of little-endian float32, so that an hour stays a few megabytes. */
function decode(series) {
  const floats = (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  };
  const clean = (values) => Array.from(values, (v) => (Number.isFinite(v) ? v : null));
  const columns = new Map();
  for (const column of series.columns) columns.set(column.name, { name: column.name, label: short(column.name), unit: column.unit, values: clean(floats(column.values)) });
  const times = Uint8Array.from(atob(series.t), (c) => c.charCodeAt(0));
  return { t: Array.from(new Float64Array(times.buffer)), columns };
}

/** "clutch.F2.pressure" → "F2": what the title of its plot says already is left out. */
function short(name) {
  return name.replace(/^(mass|clutch|shaft|driver|bus|body)\./, "").replace(/\.(speed|slip|torque|pressure|pressure_command|temperature|status|acceleration)$/, "");
}

function nearest(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) { const mid = (low + high) >> 1; if (times[mid] < t) low = mid + 1; else high = mid; }
  return low;
}
