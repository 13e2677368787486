// node look.mjs NODE_MODULES CHROMIUM REPORT.html... [--shots FOLDER]: opens reports at two widths, light and dark, and fails
// on any error in the console, a request to a network, a picture that is not drawn, or a page wider than its window. With
// --shots it keeps a picture of every page.
import { createRequire } from "node:module";
import { mkdirSync, readFileSync } from "node:fs";
import { basename, join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [modules, chromium, ...rest] = process.argv.slice(2);
const shots = rest.includes("--shots") ? rest.splice(rest.indexOf("--shots"), 2)[1] : null;
const playwright = createRequire(join(resolve(modules), "package.json"))("playwright-core");

const browser = await playwright.chromium.launch({
  executablePath: chromium,
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--no-first-run", "--disable-quic"],
});
const failures = [];
let pages = 0;

async function look(report, width, scheme) {
  const label = `${basename(report)} at ${width} px, ${scheme}`;
  const fail = (what) => failures.push(`${label}: ${what}`);
  const page = await browser.newPage({ viewport: { width, height: width < 600 ? 850 : 1000 }, colorScheme: scheme });
  page.on("console", (message) => {
    if (message.type() === "error") fail(`console: ${message.text()}`);
  });
  page.on("pageerror", (error) => fail(`error: ${error.message}`));
  page.on("request", (request) => { if (!/^(file|data|blob):/.test(request.url())) fail(`asks the network for ${request.url()}`); });
  await page.goto(pathToFileURL(resolve(report)).href);
  try {
    await page.waitForFunction(() => document.documentElement.dataset.state === "ready", null, { timeout: 120000 });
  } catch {
    fail("is not ready after two minutes");
  }
  const found = await page.evaluate(() => ({
    title: document.title,
    answer: document.querySelector("h1")?.textContent ?? "",
    figures: document.querySelectorAll("figure").length,
    missing: [...document.querySelectorAll("figure")].filter((figure) => figure.dataset.drawn !== "yes").map((figure) => figure.textContent.slice(0, 60)),
    empty: [...document.querySelectorAll(".plot")].filter((plot) => !plot.querySelector(".main-svg") || plot.offsetHeight < 100).length,
    overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    theme: document.documentElement.dataset.theme,
    licences: document.querySelector(".licences pre").textContent.includes("Plotly"),
  }));
  if (!found.title || !found.answer) fail("has no title or no answer");
  if (found.figures === 0) fail("has no figures");
  for (const figure of found.missing) fail(`not drawn: ${figure}`);
  if (found.empty > 0) fail(`${found.empty} empty pictures`);
  if (found.overflow > 0) fail(`${found.overflow} px wider than the window`);
  if (found.theme !== scheme) fail(`is ${found.theme}`);
  if (!found.licences) fail("the licences are missing");
  if (shots) {
    mkdirSync(shots, { recursive: true });
    await page.screenshot({ path: join(shots, `${basename(report, ".html")}_${width}_${scheme}.png`), fullPage: true });
  }
  await page.close();
  pages += 1;
}

for (const report of rest) {
  const megabytes = readFileSync(report).length / 1e6;
  if (megabytes > 3) failures.push(`${basename(report)} has ${megabytes.toFixed(2)} MB`);
  for (const [width, scheme] of [[400, "light"], [400, "dark"], [1600, "light"], [1600, "dark"]]) await look(report, width, scheme);
}
await browser.close();
if (rest.length === 0) failures.push("no report was given");
console.log(failures.length === 0 ? `${pages} pages of ${rest.length} reports are whole` : failures.join("\n"));
process.exit(failures.length === 0 ? 0 : 1);
