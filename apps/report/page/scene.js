// Pictures in space: surfaces, and arms with their measured points.
import { axis, layout, plain } from "./axes.js";
import { colour, colourScale } from "./theme.js";

function spaceAxis(description) {
  const { title, tickfont, gridcolor } = axis(description);
  return { title: { text: title.text, font: { size: 12, color: colour("soft") } }, tickfont: { ...tickfont, size: 11 }, gridcolor,
    showbackground: false, zerolinecolor: colour("line"), color: colour("soft"), nticks: 6 };
}

function space(block, extra = {}) {
  return layout({ height: window.innerWidth < 600 ? 360 : 520, ...block }, {
    margin: { l: 8, r: 8, t: 8, b: 32 }, // room for the titles of the axes
    scene: { xaxis: spaceAxis(block.x), yaxis: spaceAxis(block.y), zaxis: spaceAxis(block.z_axis),
      camera: { eye: { x: 1.65, y: -1.65, z: 1 } }, dragmode: "turntable", ...extra },
  });
}

const coordinates = (list) => ({ x: list.map((p) => p[0]), y: list.map((p) => p[1]), z: list.map((p) => p[2]) });

// Segments as one line with gaps.
function segments(from, to) {
  const joined = from.flatMap((start, k) => [start, to[k], [null, null, null]]);
  return coordinates(joined);
}

export function surface(block) {
  const traces = [{ type: "surface", x: block.xs, y: block.ys, z: block.z, colorscale: colourScale(false), showscale: false, opacity: 0.93,
    contours: { z: { show: false } }, lighting: { ambient: 0.75, diffuse: 0.5, specular: 0.05 }, name: plain(block.name ?? ""), hoverinfo: "x+y+z" }];
  if (block.points) {
    traces.push({ type: "scatter3d", mode: "markers", ...block.points, marker: { size: 2, color: colour("before"), opacity: 0.8 }, hoverinfo: "x+y+z", showlegend: false });
  }
  return { traces, layout: space(block, { aspectmode: "manual", aspectratio: { x: 1.2, y: 1.2, z: 0.8 } }) };
}

// An arm that moves in a plane is drawn in that plane.
function isFlat(block) {
  const all = [...block.points.at, ...block.robots.flatMap((robot) => robot.path)];
  const extent = (axis) => Math.max(...all.map((point) => point[axis])) - Math.min(...all.map((point) => point[axis]));
  return extent(2) < 1e-3 * Math.max(extent(0), extent(1));
}

function flatArm(block) {
  const lines = (list) => ({ type: "scatter", mode: "lines", x: list.x, y: list.y, hoverinfo: "skip" });
  const { x, y } = coordinates(block.points.at);
  const dots = { type: "scatter", mode: "markers", x, y, hoverinfo: "skip", name: plain(block.points.name),
    marker: { size: 4, color: colour(block.points.role), opacity: 0.8 } };
  const arrows = block.arrows.map((set) => ({ ...lines(segments(set.from, set.to)), name: plain(set.name),
    line: { color: colour(set.role), width: 2 } }));
  const robots = block.robots.map((robot) => ({ ...lines(coordinates(robot.path)), mode: "lines+markers", showlegend: false,
    line: { color: colour(robot.role), width: 7 }, marker: { size: 9, color: colour("text") } }));
  const height = window.innerWidth < 600 ? 340 : 480;
  const y_axis = { ...axis(block.y), scaleanchor: "x", scaleratio: 1, constrain: "domain" };
  return { traces: [...robots, ...arrows, dots], layout: layout({ height, ...block }, { xaxis: axis(block.x), yaxis: y_axis }) };
}

export function arm(block) {
  if (isFlat(block)) return flatArm(block);
  const traces = [];
  for (const robot of block.robots) {
    traces.push({ type: "scatter3d", mode: "lines+markers", name: plain(robot.name), ...coordinates(robot.path), hoverinfo: "name",
      line: { color: colour(robot.role), width: 9 }, marker: { size: 4.5, color: colour("text") }, showlegend: Boolean(robot.name) });
  }
  for (const set of block.arrows) {
    traces.push({ type: "scatter3d", mode: "lines", name: plain(set.name), ...segments(set.from, set.to), line: { color: colour(set.role), width: 4 }, hoverinfo: "skip", showlegend: Boolean(set.name) });
  }
  if (block.points) {
    traces.push({ type: "scatter3d", mode: "markers", name: plain(block.points.name), ...coordinates(block.points.at), text: block.points.text?.map(plain), hoverinfo: block.points.text ? "text" : "skip",
      marker: { size: 2.6, color: colour(block.points.role), opacity: 0.9 }, showlegend: Boolean(block.points.name) });
  }
  const own = space(block, { aspectmode: "data" });
  own.legend = { ...own.legend, y: 0.99, yanchor: "top", bgcolor: "rgba(0,0,0,0)", itemsizing: "constant" };
  return { traces, layout: own };
}
