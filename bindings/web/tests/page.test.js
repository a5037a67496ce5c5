// The page in a browser, without a network, beside the command.
//
// Needs the page and the command, built; the folder of shared records (TURNCAL_DATA); playwright-core; and a Chromium
// (BROWSER, by default `chromium` on the path). Screenshots go to target/web.

"use strict";

const assert = require("node:assert/strict");
const { execFileSync, spawnSync } = require("node:child_process");
const { randomBytes } = require("node:crypto");
const fs = require("node:fs");
const path = require("node:path");
const { after, before, test } = require("node:test");
const { chromium } = require("playwright-core");
const ulog = require("./ulog.js");

const root = path.join(__dirname, "../../..");
const target = process.env.CARGO_TARGET_DIR ?? path.join(root, "target");
const lot = path.join(process.env.TURNCAL_DATA ?? path.join(root, "../shared/data"), "real-mems-lot-0");
const work = path.join(target, "web/test");

let browser;
let page;
const requests = [];

before(async () => {
  fs.mkdirSync(work, { recursive: true });
  const executablePath =
    process.env.BROWSER ?? execFileSync("which", ["chromium"], { encoding: "utf8" }).trim();
  browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
  const context = await browser.newContext({ offline: true, viewport: { width: 1280, height: 900 } });
  page = await context.newPage();
  page.on("request", (request) => requests.push(request.url()));
  page.on("pageerror", (error) => assert.fail(error));
  await page.goto(`file://${target}/web/turncal.html`);
});

after(() => browser?.close());

/** The command's calibration, and the seconds that it took. */
function command(...options) {
  const begun = performance.now();
  const ran = spawnSync(path.join(target, "release/turncal"), ["calibrate", "--json", ...options]);
  assert.equal(ran.status, 0, ran.stderr.toString());
  return { calibration: JSON.parse(ran.stdout), seconds: (performance.now() - begun) / 1000 };
}

/** States fields of the form, chooses files and waits for the result or an error. */
async function choose(files, stated = {}) {
  await page.locator("#statements").evaluate((details) => (details.open = true));
  await page.locator("form").evaluate((form) => form.reset());
  for (const [name, value] of Object.entries(stated)) await page.fill(`[name=${name}]`, value);
  const begun = performance.now();
  await page.setInputFiles("#files", files);
  const end = page.locator("#report:not([hidden]), #error:not([hidden])");
  await end.first().waitFor({ timeout: 600_000 });
  return (performance.now() - begun) / 1000;
}

async function download(name) {
  await page.locator("#downloads details").evaluate((details) => (details.open = true));
  const [saved] = await Promise.all([
    page.waitForEvent("download"),
    page.click(`a[download="${name}"]`),
  ]);
  return fs.readFileSync(await saved.path(), "utf8");
}

const message = () => page.locator("#error:not([hidden])").textContent();

/** The largest difference of two calibrations in σ of the command, and whether all texts are the same. */
function compare(ours, expected) {
  const values = (calibration) =>
    expected.parameters.map((name) => {
      const [triad, part, axis] = name.split(".");
      const [row, column] = [...axis].map((letter) => "xyz".indexOf(letter));
      const value = calibration[triad][part][row];
      return column === undefined ? value : value[column];
    });
  const [a, b] = [values(ours), values(expected)];
  const of = (k) => Math.abs(a[k] - b[k]) / Math.sqrt(expected.covariance[k][k]);
  assert.deepEqual(ours.parameters, expected.parameters);
  assert.deepEqual(ours.verdict, expected.verdict);
  assert.deepEqual(ours.provenance.inputs, expected.provenance.inputs);
  return Math.max(...[...a.keys()].map(of));
}

test("a run.toml with its log gives the command's calibration in at most five times its time", async () => {
  const { calibration, seconds } = command(path.join(lot, "run.toml"));
  const files = ["run.toml", "imu.log"].map((name) => path.join(lot, name));
  const taken = await choose(files);
  const ours = JSON.parse(await download("calibration.json"));
  const off = compare(ours, calibration);
  console.log(`lot-0: ${off.toExponential(1)} σ; ${taken.toFixed(2)} s, the command ${seconds.toFixed(2)} s`);
  assert.ok(off <= 1e-9, `${off} σ`);
  assert.ok(taken <= 5 * seconds, `${taken} s, the command ${seconds} s`);
  await page.screenshot({ path: path.join(work, "lot-0-1280.png"), fullPage: true });
});

test("a log alone is described, and calibrated as by the command with the same options", async () => {
  const log = path.join(lot, "imu.log");
  const { calibration } = command(log, "--rate", "100", "--latitude", "61.8");
  await choose([log], { rate: "100", latitude: "61.8" });
  const found = await page.locator("#found").textContent();
  assert.match(found, /4 5 6, rad\/s/);
  assert.match(found, /1 2 3, m\/s\^2/);
  assert.match(await page.locator("#report .verdict").textContent(), /^GOOD/);
  assert.equal(await page.locator("#report figure svg").first().isVisible(), true);
  const off = compare(JSON.parse(await download("calibration.json")), calibration);
  assert.ok(off <= 1e-9, `${off} σ`);
  assert.match(await download("kalibr.yaml"), /gyroscopes:/);
  assert.match(await download("run.toml"), /file = "imu.log"/);
  assert.match(await download("report.html"), /<svg/);
});

test("a ULog file gives the command's calibration", async () => {
  const lines = fs.readFileSync(path.join(lot, "imu.log"), "utf8").trim().split("\n");
  const rows = lines.map((line) => line.trim().split(/[\s,]+/).map(Number));
  const log = path.join(work, "lot-0.ulg");
  fs.writeFileSync(log, ulog(rows, 100));
  const { calibration } = command(log, "--latitude", "61.8");
  await choose([log], { latitude: "61.8" });
  const off = compare(JSON.parse(await download("calibration.json")), calibration);
  console.log(`ULog: ${off.toExponential(1)} σ`);
  assert.ok(off <= 1e-9, `${off} σ`);
});

test("what is no log gets a message that says what to do, and the page goes on", async () => {
  const log = fs.readFileSync(path.join(lot, "imu.log"));
  const cut = fs.readFileSync(path.join(work, "lot-0.ulg")).subarray(0, 100_001);
  const film = Buffer.concat([Buffer.from("\0\0\0\x18ftypmp42"), randomBytes(5_000_000)]);
  for (const [name, buffer, expected] of [
    ["cut.ulg", cut, /found .* before the end of the file.*salvage = true/],
    ["cut.log", log.subarray(0, 5_001), /expected .*\. [A-Z]/],
    ["empty.csv", Buffer.alloc(0), /an empty file.*Record or export the file again/],
    ["film.mp4", film, /binary data of an unknown format.*Convert the file/],
    ["run.toml", fs.readFileSync(path.join(lot, "run.toml")), /imu\.log: .*add the file/],
  ]) {
    await choose([{ name, mimeType: "", buffer }], { rate: "100" });
    assert.match(await message(), expected, name);
  }
  await choose([path.join(lot, "imu.log")], { sensor: "bmi088x" });
  assert.match(await message(), /did you mean "bmi088"/);
  await choose([path.join(lot, "imu.log")], { rate: "100" });
  assert.match(await page.locator("#report .verdict").textContent(), /^[A-Z]/);
});

test("200 MB get a message while they are read, and can be stopped", async () => {
  const log = path.join(work, "long.log");
  const rows = fs.readFileSync(path.join(lot, "imu.log"));
  fs.writeFileSync(log, Buffer.concat(Array(Math.ceil(200e6 / rows.length)).fill(rows)));
  await page.setInputFiles("#files", [log]);
  const activity = page.locator("#activity");
  await activity.getByText("reading").waitFor();
  assert.match(await activity.textContent(), /can take minutes/);
  await page.click("#stop");
  assert.equal(await activity.isVisible(), false);
  fs.rmSync(log);
  await choose([path.join(lot, "imu.log")], { rate: "100" });
  assert.equal(await page.locator("#report").isVisible(), true);
});

test("the page fits a phone", async () => {
  await page.setViewportSize({ width: 390, height: 844 });
  await choose([path.join(lot, "imu.log")], { rate: "100", latitude: "61.8" });
  const width = await page.evaluate(() => document.documentElement.scrollWidth);
  await page.screenshot({ path: path.join(work, "lot-0-390.png"), fullPage: true });
  assert.ok(width <= 390, `${width} pixels`);
});

test("nothing is sent or fetched", () => {
  const other = requests.filter((url) => !/^(file|blob|data):/.test(url));
  assert.deepEqual(other, []);
});
