// A figure over a plane: error maps, correlations, the boxes of a tree.
import { axis, layout, plain } from "./axes.js";
import { colour, colourScale } from "./theme.js";

function range(block) {
  if (block.limit) return { zmin: block.diverging ? -block.limit : 0, zmax: block.limit };
  return block.diverging ? { zmid: 0 } : {};
}

export function map(block) {
  const narrow = window.innerWidth < 600;
  const heat = {
    type: "heatmap", x: block.xs, y: block.ys, z: block.z, colorscale: colourScale(block.diverging), ...range(block),
    hoverongaps: false, xgap: block.cells ? 1 : 0, ygap: block.cells ? 1 : 0,
    colorbar: { title: { text: plain(block.unit), side: "right" }, thickness: 12, outlinewidth: 0, tickfont: { size: 11, color: colour("soft") }, x: 1.01 },
  };
  if (block.text) Object.assign(heat, { text: block.text.map((row) => row.map(plain)), hoverinfo: "text" });
  const traces = [heat];
  if (block.points) {
    traces.push({ type: "scatter", mode: "markers", x: block.points.x, y: block.points.y, hoverinfo: "skip", showlegend: false,
      marker: { size: 3.5, color: colour("text"), opacity: 0.45 } });
  }
  const shapes = (block.boxes ?? []).map((box) => ({ type: "rect", x0: box.x0, x1: box.x1, y0: box.y0, y1: box.y1, line: { color: colour("text"), width: 1.2 } }));
  const annotations = (block.boxes ?? []).filter((box) => box.label).map((box) => ({
    x: (box.x0 + box.x1) / 2, y: (box.y0 + box.y1) / 2, text: plain(box.label), showarrow: false, font: { size: narrow ? 10 : 12, color: colour("text") },
    bgcolor: colour("card"), opacity: 0.85, borderpad: 2 }));
  const y = axis(block.y);
  if (block.reversed) y.autorange = "reversed";
  if (block.equal) Object.assign(y, { scaleanchor: "x", scaleratio: 1, constrain: "domain" });
  return { traces, layout: layout(block, { xaxis: { ...axis(block.x), constrain: "domain" }, yaxis: y, shapes, annotations, showlegend: false }) };
}
