// What all pictures of Plotly have in common: axes, fonts, legends.
import { colour } from "./theme.js";

// Plotly reads tags in text; names come from files.
export const plain = (text) => String(text ?? "").replaceAll("&", "&amp;").replaceAll("<", "&lt;");

export const config = {
  responsive: true,
  displaylogo: false,
  displayModeBar: "hover",
  modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"],
  showTips: false,
};

export function axis(description = {}) {
  const result = {
    title: { text: plain(description.title), font: { size: 13, color: colour("soft") }, standoff: 8 },
    gridcolor: colour("grid"),
    zerolinecolor: colour("line"),
    linecolor: colour("line"),
    tickfont: { size: 12, color: colour("soft") },
    automargin: true,
    separatethousands: true,
    exponentformat: "power",
    minexponent: 4,
  };
  if (description.log) Object.assign(result, { type: "log", dtick: "D2", tickformat: "~r", exponentformat: "none" });
  if (description.range) result.range = description.range;
  if (description.categories) {
    const all = description.categories;
    Object.assign(result, { tickmode: "array", tickvals: all.map((_, k) => k), ticktext: all.map(plain) });
  }
  return result;
}

export function layout(block, extra = {}) {
  const narrow = window.innerWidth < 600;
  return {
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: getComputedStyle(document.body).fontFamily, size: 13, color: colour("text") },
    margin: { l: narrow ? 44 : 56, r: 14, t: 8, b: 44 },
    height: block.height ?? (narrow ? 320 : 400),
    hoverlabel: { bgcolor: colour("card"), bordercolor: colour("line"), font: { color: colour("text"), size: 13 } },
    legend: { orientation: "h", x: 0, y: 1.02, xanchor: "left", yanchor: "bottom", font: { size: 12.5 } },
    dragmode: narrow ? false : "zoom",
    ...extra,
  };
}
