// Linked uPlot charts: one cursor, one time range, events and shift phases drawn behind the lines.
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { display, format, h } from "./dom.js";
import { css, lines } from "./palette.js";

/**
 * A stack of charts over one time axis.
 * groups: [{title, columns: [{name, label, unit, values}]}]; t: seconds; bands: [{from, to, label}]; marks: [{t, text}].
 */
export function plotStack(parent, { t, groups, bands = [], marks = [], onCursor, live = false }) {
  const sync = uPlot.sync(`stack-${Math.random()}`);
  const charts = [];
  let applying = false;

  const share = (source) => {
    if (applying || live) return;
    applying = true;
    const { min, max } = source.scales.x;
    for (const chart of charts) if (chart !== source) chart.setScale("x", { min, max });
    applying = false;
  };

  const background = (chart) => {
    const { ctx, bbox } = chart;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const band of bands) {
      const left = chart.valToPos(band.from, "x", true), right = chart.valToPos(band.to, "x", true);
      ctx.fillStyle = css("--accent") + "22";
      ctx.fillRect(left, bbox.top, Math.max(1, right - left), bbox.height);
      if (right - left > 40 && band.label) {
        ctx.fillStyle = css("--faint");
        ctx.font = `${11 * devicePixelRatio}px sans-serif`;
        ctx.fillText(band.label, left + 4, bbox.top + 13 * devicePixelRatio);
      }
    }
    ctx.strokeStyle = css("--faint") + "88";
    ctx.setLineDash([3, 4]);
    for (const mark of marks) {
      const x = chart.valToPos(mark.t, "x", true);
      ctx.beginPath(); ctx.moveTo(x, bbox.top); ctx.lineTo(x, bbox.top + bbox.height); ctx.stroke();
    }
    ctx.restore();
  };

  for (const group of groups) {
    if (!group.columns.length) continue;
    const shown = display(group.columns[0].unit, group.columns[0].name);
    const holder = h("figure", { class: "plot", "aria-label": `${group.title} over time` });
    holder.append(h("figcaption", {}, h("strong", {}, group.title), h("span", { class: "faint" }, shown.unit ? ` [${shown.unit}]` : "")));
    parent.append(holder);
    const axis = { stroke: () => css("--faint"), grid: { stroke: () => css("--edge") + "88" }, ticks: { stroke: () => css("--edge") } };
    const chart = new uPlot({
      width: Math.max(260, holder.clientWidth || 600),
      height: group.height ?? 190,
      cursor: { sync: { key: sync.key }, drag: { x: true, y: false } },
      scales: { x: { time: false } },
      axes: [{ ...axis, size: 34 }, { ...axis, size: 58 }],
      series: [
        { label: "t", value: (_, v) => (v === null || v === undefined ? "–" : `${v.toFixed(3)} s`) },
        ...group.columns.map((column, i) => ({
          label: column.label ?? column.name, stroke: lines[i % lines.length], width: 1.6, points: { show: false },
          value: (_, v) => (v === null || v === undefined ? "–" : format(v, shown.digits)),
        })),
      ],
      hooks: {
        drawAxes: [background],
        setScale: [(self, key) => key === "x" && share(self)],
        setCursor: [(self) => onCursor && self.cursor.idx !== null && self.cursor.event && onCursor(self.data[0][self.cursor.idx])],
      },
    }, [t, ...group.columns.map((column) => scale(column.values, shown.factor))], holder);
    chart.factor = shown.factor;
    charts.push(chart);
  }

  const resize = () => charts.forEach((chart) => chart.setSize({ width: Math.max(260, chart.root.parentElement.clientWidth), height: chart.height }));
  addEventListener("resize", resize);
  addEventListener("beforeprint", resize);

  return {
    charts,
    zoom(min, max) { charts.forEach((chart) => chart.setScale("x", { min, max })); },
    reset() { this.zoom(t[0], t[t.length - 1]); },
    /** New data for a live stack: columns in the same order as the groups. */
    update(time, columns) {
      let next = 0;
      for (const chart of charts) {
        const count = chart.series.length - 1;
        chart.setData([time, ...columns.slice(next, next + count).map((values) => scale(values, chart.factor))]);
        next += count;
      }
    },
  };
}

function scale(values, factor) {
  if (factor === 1) return values;
  return Array.from(values, (v) => (v === null ? null : v * factor));
}
