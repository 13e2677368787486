// Builds the page from the data document in it. apps/report/document.hpp says what the document holds.
import Plotly from "plotly.js/lib/core";
import bar from "plotly.js/lib/bar";
import heatmap from "plotly.js/lib/heatmap";
import scatter3d from "plotly.js/lib/scatter3d";
import surfaceTrace from "plotly.js/lib/surface";

import { config } from "./axes.js";
import { chart } from "./chart.js";
import { element } from "./dom.js";
import { map } from "./map.js";
import { arm, surface } from "./scene.js";
import { startTheme } from "./theme.js";
import { table, text, tree } from "./words.js";

Plotly.register([bar, heatmap, scatter3d, surfaceTrace]);

const plots = { chart, map, surface, arm };
const words = { table, tree, text };
const inSpace = new Set(["surface", "arm"]);
const drawn = [];

function blockElement(block) {
  const figure = element("figure", { class: `block${block.wide ? " wide" : ""}${inSpace.has(block.kind) ? " scene" : ""}` });
  if (block.title) figure.append(element("h3", {}, block.title));
  if (block.caption) figure.append(element("figcaption", {}, block.caption));
  if (words[block.kind]) {
    figure.append(words[block.kind](block));
    figure.dataset.drawn = "yes";
  } else {
    const place = element("div", { class: "plot", role: "img", "aria-label": block.title ?? "" });
    figure.append(place);
    drawn.push({ block, figure, place });
  }
  return figure;
}

function sectionElement(section) {
  const blocks = element("div", { class: "blocks" }, ...section.blocks.map(blockElement));
  return element("section", {}, section.title ? element("h2", {}, section.title) : null, section.text ? element("p", {}, section.text) : null, blocks);
}

// A canvas in space does not print: an image stands in for it.
async function addPrintImage({ figure, place }) {
  const data = await Plotly.toImage(place, { format: "png", width: 900, height: 560 });
  figure.querySelector(".print")?.remove();
  figure.append(element("img", { class: "print", src: data, alt: "" }));
}

async function draw(item) {
  const { traces, layout } = plots[item.block.kind](item.block);
  await Plotly.react(item.place, traces, layout, config);
  if (inSpace.has(item.block.kind)) await addPrintImage(item);
  item.figure.dataset.drawn = "yes";
}

async function drawAll() {
  for (const item of drawn) {
    await draw(item);
    await new Promise((next) => setTimeout(next, 0));
  }
  document.documentElement.dataset.state = "ready";
}

// On paper nothing can be opened.
window.addEventListener("beforeprint", () => {
  for (const details of document.querySelectorAll("main details")) details.open = true;
});

const report = JSON.parse(document.getElementById("report").textContent);
const main = document.querySelector("main");
startTheme(document.querySelector(".switch"), drawAll);
document.querySelector(".brand").textContent = report.title;
document.querySelector(".origin").textContent = report.origin;
main.append(element("h1", {}, report.answer));
if (report.lead) main.append(element("p", { class: "lead" }, report.lead));
main.append(...report.sections.map(sectionElement));
drawAll();
