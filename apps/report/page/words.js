// Blocks that are no plots: tables, and the tree with its conditions, equations and slopes.
import { element } from "./dom.js";
import { colour } from "./theme.js";

export function table(block) {
  const words = new Set(block.words ?? []);
  const cell = (tag) => (text, k) => element(tag, words.has(k) ? { class: "words" } : {}, text);
  const head = element("tr", {}, ...block.header.map(cell("th")));
  const rows = block.rows.map((row, k) => element("tr", k === block.marked ? { class: "marked" } : {}, ...row.map(cell("td"))));
  return element("div", { class: "scroll" }, element("table", {}, element("thead", {}, head), element("tbody", {}, ...rows)));
}

// A bar for each slope: how far the prediction moves when the input goes through the middle half of its values.
function slopes(leaf, largest) {
  const grid = element("div", { class: "slopes" });
  for (const { name, effect } of leaf.slopes) {
    const share = (50 * Math.abs(effect)) / (largest || 1);
    const bar = element("i");
    bar.style.background = colour(effect < 0 ? "down" : "up");
    bar.style.width = `${share}%`;
    bar.style[effect < 0 ? "right" : "left"] = "50%";
    grid.append(element("span", { class: "name", title: name }, name), element("span", { class: "track" }, bar));
  }
  return grid;
}

function leafCard(leaf, largest) {
  const card = element("div", { class: "leaf" });
  for (const equation of leaf.equations) card.append(element("div", { class: "formula" }, equation));
  if (leaf.slopes.length > 0) card.append(slopes(leaf, largest));
  return card;
}

function node(part, depth, largest, openTo) {
  const label = [element("span", { class: "if" }, part.condition || "everywhere"), element("span", { class: "rows" }, part.rows)];
  if (part.leaf) return element("li", {}, ...label, leafCard(part.leaf, largest));
  const inner = element("ul", {}, ...part.children.map((child) => node(child, depth + 1, largest, openTo)));
  if (depth === 0) return element("li", {}, ...label, inner);
  const details = element("details", depth <= openTo ? { open: "" } : {}, element("summary", {}, ...label), inner);
  return element("li", {}, details);
}

function leavesOf(part) {
  return part.leaf ? [part.leaf] : part.children.flatMap(leavesOf);
}

export function tree(block) {
  const leaves = leavesOf(block.root);
  const largest = Math.max(0, ...leaves.flatMap((leaf) => leaf.slopes.map((slope) => Math.abs(slope.effect))));
  return element("ul", { class: "tree" }, node(block.root, 0, largest, leaves.length > 16 ? 2 : 99));
}

export function text(block) {
  return element("div", {}, ...block.lines.map((line) => element("p", { class: "note" }, line)));
}
