// node bundle.mjs NODE_MODULES OUTPUT: the page of every report in one file: style, script, the plotting library and its
// licences. The programs put their data where the page has its marks (apps/report/page.cpp).
import { createRequire } from "node:module";
import { existsSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const modules = resolve(process.argv[2]);
const output = resolve(process.argv[3]);
const esbuild = createRequire(join(modules, "package.json"))("esbuild");

const built = await esbuild.build({
  entryPoints: [join(here, "main.js")],
  bundle: true,
  minify: true,
  write: false,
  metafile: true,
  outdir: dirname(output),
  target: "es2020",
  format: "iife",
  charset: "utf8",
  legalComments: "none", // the licences stand in the page in full
  define: { global: "window" },
  loader: { ".css": "empty" }, // of maps, which no report has
  nodePaths: [modules],
  logLevel: "warning",
});
const script = built.outputFiles[0].text.replaceAll("</script", "<\\/script");

// The packages whose code is in the bundle, with what each says of its licence.
function packages() {
  const names = new Set();
  for (const file of Object.keys(built.metafile.inputs)) {
    const parts = file.split("node_modules/").pop().split("/");
    if (file.includes("node_modules/")) names.add(parts[0].startsWith("@") ? parts.slice(0, 2).join("/") : parts[0]);
  }
  return [...names].sort();
}

function licence(name) {
  const folder = join(modules, name);
  const about = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  const file = readdirSync(folder).find((entry) => /^(licen[cs]e|copying)/i.test(entry));
  const text = file && existsSync(join(folder, file)) ? readFileSync(join(folder, file), "utf8").trim() : "";
  return `${name} ${about.version} (${about.license ?? "see its text"})\n\n${text}\n`;
}

const escape = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
const parts = {
  "/*style*/": () => readFileSync(join(here, "style.css"), "utf8"),
  "/*script*/": () => script,
  "<!--licences-->": () => escape(packages().map(licence).join("\n----\n\n")),
};
let page = readFileSync(join(here, "page.html"), "utf8");
for (const [mark, text] of Object.entries(parts)) {
  if (page.split(mark).length !== 2) throw new Error(`page.html must have one ${mark}`);
  page = page.replace(mark, text);
}
writeFileSync(output, page);
