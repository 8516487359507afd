// Live colours and values on the driveline drawing, by the ids the drawing carries.
import { display, format } from "./dom.js";

/** Paint states and values into the drawing: friction devices by state, gears by direction of power, masses by speed. */
export function colour(svg, lookup) {
  for (const group of svg.querySelectorAll("g.device, g.mass")) {
    const isMass = group.id.startsWith("mass-"), name = group.id.replace(/^(device|mass)-/, "");
    const value = group.querySelector("text.value");
    if (isMass) {
      const speed = lookup(`mass.${name}.speed`);
      if (speed && value) { const shown = display(speed.unit); value.textContent = `${format(speed.value * shown.factor, shown.digits)} ${shown.unit}`; }
      continue;
    }
    const state = lookup(`clutch.${name}.state`);
    if (state) {
      group.classList.remove("open", "slipping", "locked");
      group.classList.add(["locked", "slipping", "open"][Math.round(state.value)] ?? "open");
    }
    const torque = lookup(`clutch.${name}.torque`) ?? lookup(`shaft.${name}.torque`) ?? lookup(`gear.${name}.torque`) ?? lookup(`row.${name}.sun`);
    const direction = lookup(`gear.${name}.direction`) ?? lookup(`row.${name}.direction`);
    const arrow = direction ? (direction.value > 0 ? " ▶" : direction.value < 0 ? " ◀" : " ■") : "";
    if (torque && value) value.textContent = `${format(torque.value, 0)} Nm${arrow}`;
  }
}
