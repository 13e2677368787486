// Points, lines, bars, bands and error bars over two axes.
import { axis, layout, plain } from "./axes.js";
import { colour, withAlpha } from "./theme.js";

function points(layer, shade) {
  const many = layer.x.length > 600;
  const marker = { color: withAlpha(shade, many ? 0.45 : 0.75), size: layer.size ?? (many ? 4 : 7), line: { width: 0 } };
  const named = layer.labels ? { text: layer.labels.map(plain), hoverinfo: "text+x+y" } : {};
  return [{ type: "scatter", mode: "markers", marker, ...named }];
}

const line = (layer, shade) => [{
  type: "scatter", mode: "lines",
  line: { color: shade, width: layer.size ?? (layer.dash ? 1.6 : 2.2), dash: layer.dash ? "dash" : "solid", shape: layer.steps ? "hv" : "linear" },
}];

function bars(layer, shade, overlay) {
  const trace = { type: "bar", opacity: overlay ? 0.6 : 1, marker: { color: layer.roles ? layer.roles.map(colour) : shade, line: { width: 0 } } };
  if (layer.horizontal) Object.assign(trace, { orientation: "h", x: layer.y, y: layer.x });
  if (layer.base) trace.base = layer.base;
  if (layer.width) trace.width = layer.width;
  if (layer.labels) Object.assign(trace, { text: layer.labels.map(plain), textposition: "outside", cliponaxis: false, hoverinfo: "text" });
  const errors = layer.low && { type: "data", symmetric: false, color: colour("soft"), thickness: 1.2, width: 3,
    array: layer.high.map((value, k) => value - layer.y[k]), arrayminus: layer.low.map((value, k) => layer.y[k] - value) };
  if (errors) trace[layer.horizontal ? "error_x" : "error_y"] = errors;
  return [trace];
}

const band = (layer, shade) => [
  { type: "scatter", mode: "lines", y: layer.low, line: { width: 0 }, hoverinfo: "skip", showlegend: false },
  { type: "scatter", mode: "lines", y: layer.high, line: { width: 0 }, fill: "tonexty", fillcolor: withAlpha(shade, 0.18), hoverinfo: "skip" },
];

const marks = { points, line, bars, band };

// Room for the labels at the ends of horizontal bars.
function labelledRange(layer) {
  const ends = layer.y.map((value, k) => (layer.base?.[k] ?? 0) + value);
  const low = Math.min(0, ...ends);
  const high = Math.max(0, ...ends);
  const room = window.innerWidth < 600 ? 0.4 : 0.26;
  return [low < 0 ? low - room * (high - low) : 0, high + room * (high - low)];
}

export function chart(block) {
  const traces = block.layers.flatMap((layer) => {
    const common = { name: plain(layer.name), x: layer.x, y: layer.y, showlegend: Boolean(layer.name) };
    return marks[layer.mark](layer, colour(layer.role ?? "data"), block.overlay && block.layers.length > 1).map((own) => ({ ...common, ...own }));
  });
  const horizontal = block.layers.some((layer) => layer.horizontal);
  const x = axis(block.x);
  const y = axis(block.y);
  if (horizontal) y.autorange = "reversed";
  if (block.equal) Object.assign(y, { scaleanchor: "x", scaleratio: 1 });
  const labelled = block.layers.find((layer) => layer.horizontal && layer.labels);
  if (labelled && labelled.low === undefined) x.range = labelledRange(labelled);
  const rows = horizontal ? (block.y.categories?.length ?? 0) : 0;
  const named = traces.filter((trace) => trace.showlegend).length;
  const extra = { xaxis: x, yaxis: y, barmode: block.stacked ? "stack" : (block.overlay ? "overlay" : "group"), bargap: block.overlay ? 0.04 : 0.3, showlegend: named > 1 };
  if (block.refs) {
    extra.shapes = block.refs.map((ref) => ({
      type: "line", xref: ref.axis === "x" ? "x" : "paper", yref: ref.axis === "x" ? "paper" : "y",
      x0: ref.axis === "x" ? ref.value : 0, x1: ref.axis === "x" ? ref.value : 1,
      y0: ref.axis === "x" ? 0 : ref.value, y1: ref.axis === "x" ? 1 : ref.value,
      line: { color: colour(ref.role ?? "floor"), width: 1.8, dash: "dot" },
    }));
    extra.annotations = block.refs.map((ref) => ({
      text: plain(ref.name), showarrow: false, font: { size: 12, color: colour(ref.role ?? "floor") },
      xref: ref.axis === "x" ? "x" : "paper", yref: ref.axis === "x" ? "paper" : "y",
      x: ref.axis === "x" ? ref.value : 1, y: ref.axis === "x" ? 1 : ref.value, xanchor: ref.axis === "x" ? "left" : "right", yanchor: ref.axis === "x" ? "top" : "bottom",
    }));
  }
  const height = rows > 0 ? Math.max(180, 90 + 30 * rows) : undefined;
  return { traces, layout: layout({ height, ...block }, extra) };
}
