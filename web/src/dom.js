// The few lines of DOM help both pages need.

/** Make an element: h("button", {class: "x", onclick: f}, "text", child). Values are set as text, never as HTML. */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (value === true) element.setAttribute(key, "");
    else element.setAttribute(key, String(value));
  }
  for (const child of children.flat()) if (child !== null && child !== undefined) element.append(child);
  return element;
}

const toRpm = 30 / Math.PI;

/** How a quantity of the plant is shown to people: unit, factor and digits. Rotational speeds in rpm, pressures in bar. */
export function display(unit, name = "") {
  switch (unit) {
    case "rad/s": return { unit: "rpm", factor: toRpm, digits: 0 };
    case "Pa": return { unit: "bar", factor: 1e-5, digits: 2 };
    case "m/s": return { unit: "km/h", factor: 3.6, digits: 2 };
    case "Nm": return { unit: "Nm", factor: 1, digits: 0 };
    case "N": return { unit: "kN", factor: 1e-3, digits: 1 };
    case "J": return { unit: "kJ", factor: 1e-3, digits: 2 };
    case "W": return { unit: "kW", factor: 1e-3, digits: 1 };
    case "°C": return { unit: "°C", factor: 1, digits: 1 };
    default: return { unit, factor: 1, digits: unit === "" && /slip|load/.test(name) ? 3 : 2 };
  }
}

export function format(value, digits = 2) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  return value.toFixed(digits).replace(/^-(0(\.0*)?)$/, "$1");
}

/** A metric of a shift: as many digits as tell something. */
export function measured(metric) {
  if (metric.value === null) return "–";
  const size = Math.abs(metric.value);
  return `${format(metric.value, size >= 100 ? 0 : size >= 10 ? 1 : 3)} ${metric.unit}`;
}

/** Insert an SVG the rig drew itself (driveline), parsed as XML: scripts and handlers are dropped. */
export function drawing(text) {
  const parsed = new DOMParser().parseFromString(text, "image/svg+xml").documentElement;
  if (parsed.nodeName.toLowerCase() !== "svg") return h("p", {}, "The driveline could not be drawn.");
  parsed.querySelectorAll("script, foreignObject").forEach((node) => node.remove());
  parsed.querySelectorAll("*").forEach((node) => {
    for (const attribute of [...node.attributes]) if (/^on/i.test(attribute.name)) node.removeAttribute(attribute.name);
  });
  return document.importNode(parsed, true);
}

