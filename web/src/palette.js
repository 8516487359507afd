// Line colours that keep apart on light and dark ground and for the common colour-vision deficiencies
// (Okabe–Ito, darkened for contrast on white).
export const lines = ["#0b6cb3", "#c44e00", "#00795c", "#b0407f", "#8a6d00", "#2f95c9", "#5b5b5b", "#7a3db8", "#a11d21", "#3f7f1f"];

export const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
