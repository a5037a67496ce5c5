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
  const end = page.locator("#verdict:not([hidden]), #error:not([hidden])");
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
  const ours = JSON.parse(await download("imu-calibration.json"));
  const off = compare(ours, calibration);
  console.log(`lot-0: ${off.toExponential(1)} σ; ${taken.toFixed(2)} s, the command ${seconds.toFixed(2)} s`);
  assert.ok(off <= 1e-9, `${off} σ`);
  assert.ok(taken <= 5 * seconds, `${taken} s, the command ${seconds} s`);
  await page.screenshot({ path: path.join(work, "lot-0-1280.png"), fullPage: true });
});

test("a log alone is described below its verdict, and calibrated as by the command with the same options", async () => {
  const log = path.join(lot, "imu.log");
  const { calibration } = command(log, "--rate", "100", "--latitude", "61.8");
  await choose([log], { rate: "100", latitude: "61.8" });
  const found = await page.locator("#verdict + #notes + #found").textContent();
  assert.match(found, /4 5 6, rad\/s/);
  assert.match(found, /1 2 3, m\/s\^2/);
  assert.match(await page.locator("#result .verdict").textContent(), /^GOOD/);
  assert.equal(await page.locator("#result figure svg").first().isVisible(), true);
  const off = compare(JSON.parse(await download("imu-calibration.json")), calibration);
  assert.ok(off <= 1e-9, `${off} σ`);
  assert.match(await download("run.toml"), /file = "imu.log"/);
  assert.match(await download("imu-report.html"), /<svg/);
});

test("values are open, and findings name the fields of the page, no options and no sections", async () => {
  await choose([path.join(lot, "imu.log")], { rate: "100" });
  const values = page.locator("#details > section", { hasText: "Parameters" });
  assert.match(await values.innerText(), /u = correction · \(N − bias\)[^]*gyro\.scale\.x/);
  const findings = await page.locator(".findings").evaluate((of) => of.textContent);
  assert.match(findings, /“Latitude” and “Height”/);
  assert.doesNotMatch(findings, /--[a-z]|\[[a-z.]+\]|`/);
});

test("exports carry the name of the log, except a function, which has that of its file", async () => {
  assert.match(await download("imu-kalibr.yaml"), /gyroscopes:/);
  assert.match(await download("turncal_calibrate.m"), /^function u = turncal_calibrate/m);
});

test("a failed calibration offers no exports", async () => {
  const run = fs.readFileSync(path.join(lot, "run.toml"), "utf8");
  const wrong = run.replace(/(prior\.accel\]\nscale = )1\.0(\nscale_sigma_ppm = )30000/, "$11.2$21000");
  const file = { name: "run.toml", mimeType: "", buffer: Buffer.from(wrong) };
  const log = { name: "imu.log", mimeType: "", buffer: fs.readFileSync(path.join(lot, "imu.log")) };
  await choose([file, log]);
  assert.match(await page.locator("#result .verdict").textContent(), /^FAILED/);
  assert.equal(await page.locator("#downloads details a").count(), 0);
  assert.match(await page.locator("#caution").textContent(), /None, because the calibration failed/);
});

test("exports say how many parameters are not determined", async () => {
  const folder = path.join(lot, "../real-mems-static");
  await choose(["run.toml", "imu.csv.gz", "segments.csv"].map((name) => path.join(folder, name)));
  const counts = (await page.locator("#result .verdict").textContent()).match(/(\d+) of (\d+)/);
  const caution = await page.locator("#caution").textContent();
  assert.match(caution, new RegExp(`^${counts[2] - counts[1]} parameters are not determined`));
});

test("a decimal comma is a point, and a wrong number is refused beside its field", async () => {
  const log = path.join(lot, "imu.log");
  await choose([log], { rate: "100,5", latitude: "−61,8" });
  const found = await page.locator("#found").textContent();
  assert.match(found, /100\.5 Hz/);
  assert.match(found, /latitude -61\.8°/);
  for (const [name, text, limits] of [
    ["rate", "0", /above 0/],
    ["rate", "100 Hz", /found 100 Hz, expected a number/i],
    ["rate", "1.000,5", /above 0/],
    ["latitude", "95", /from −90 to 90/],
    ["height", "9001", /from −500 to 9000/],
    ["gravity", "1", /from 9.7 to 9.9/],
  ]) {
    await choose([log], { [name]: text });
    assert.match(await page.locator(`label:has([name=${name}]) small`).textContent(), limits, text);
  }
});

test("a wrong option in closed options opens them with a message, and the log is kept", async () => {
  await page.locator("form").evaluate((form) => form.reset());
  await page.fill("[name=rate]", "fast");
  await page.locator("#statements").evaluate((details) => (details.open = false));
  await page.setInputFiles("#files", [path.join(lot, "imu.log")]);
  assert.match(await message(), /“Sample rate”.*“Calibrate again”/);
  assert.equal(await page.locator("[name=rate]").evaluate((field) => field === document.activeElement), true);
  await page.fill("[name=rate]", "100");
  await page.click("#again");
  await page.locator("#result .verdict").waitFor();
  assert.equal(await page.locator("#stale").isVisible(), false);
  await page.fill("[name=latitude]", "61.8");
  assert.equal(await page.locator("#stale").isVisible(), true);
});

test("names of sensors need no hyphens and units may be quoted", async () => {
  const stated = { rate: "100", sensor: "Icm42688 P", "gyro-unit": "'rad/s'" };
  await choose([path.join(lot, "imu.log")], stated);
  assert.equal(await page.locator("#result .verdict").isVisible(), true);
});

test("files that would not be used are refused, and files that are missing are named", async () => {
  const file = (name, from = "imu.log") => ({ name, mimeType: "", buffer: fs.readFileSync(path.join(lot, from)) });
  for (const [files, expected] of [
    [["a.log", "b.log", "c.log"], /Found 3 logs: a\.log, b\.log, c\.log\. Drop one log; or one of the gyros/],
    [["a.log", "a.log"], /Found 2 logs/],
    [["acc.log", "acc2.log"], /Found 2 logs/],
    [["a.toml", "b.toml"], /expected one run\.toml/],
  ]) {
    await choose(files.map((name) => file(name)), { rate: "100" });
    assert.match(await message(), expected);
  }
  const run = (text) => ({ name: "run.toml", mimeType: "", buffer: Buffer.from(text) });
  const files = '[imu]\nfile = "logs/imu.csv"\n[segments]\nfile = "segments.csv"\n';
  await choose([run(files), file("other.csv")]);
  assert.match(await message(), /names files that you did not drop: .*imu\.csv, segments\.csv\./);
  const folder = ["run.toml", "imu.log", "reference.json"];
  await choose(folder.map((name) => file(name, name)), { rate: "100" });
  const notes = await page.locator("#notes").innerText();
  assert.match(notes, /Not used.*: reference\.json/);
  assert.match(notes, /options had no effect/);
});

test("one log of the gyros and one of the accelerometers are one recording, in any order", async () => {
  const lines = fs.readFileSync(path.join(lot, "imu.log"), "utf8").trim().split("\n");
  const rows = lines.map((line) => line.trim().split(/[\s,]+/));
  const csv = (name, first) => {
    const text = rows.map((row, k) => [k / 100, ...row.slice(first, first + 3)].join(","));
    return { name, mimeType: "", buffer: Buffer.from(["t,x,y,z", ...text, ""].join("\n")) };
  };
  await choose([csv("Accelerometer.csv", 0), csv("Gyroscope.csv", 3)], { "gyro-unit": "rad/s", "accel-unit": "m/s^2" });
  assert.match(await page.locator("#result .verdict").textContent(), /21 of 21/);
});

test("a ULog file gives the command's calibration", async () => {
  const lines = fs.readFileSync(path.join(lot, "imu.log"), "utf8").trim().split("\n");
  const rows = lines.map((line) => line.trim().split(/[\s,]+/).map(Number));
  const log = path.join(work, "lot-0.ulg");
  fs.writeFileSync(log, ulog(rows, 100));
  const { calibration } = command(log, "--latitude", "61.8");
  await choose([log], { latitude: "61.8" });
  const off = compare(JSON.parse(await download("lot-0-calibration.json")), calibration);
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
    ["photo.csv", fs.readFileSync(path.join(work, "lot-0-1280.png")), /a picture, expected a log/],
    ["a.json", Buffer.from('{"format": "turncal-calibration/1"}'), /a calibration of turncal, expected a log/],
    ["report.html", Buffer.from("<!DOCTYPE html><html>"), /a web page.*expected a log/],
  ]) {
    await choose([{ name, mimeType: "", buffer }], { rate: "100" });
    assert.match(await message(), expected, name);
  }
  await choose([path.join(lot, "imu.log")], { sensor: "bmi088x" });
  assert.match(await message(), /Did you mean bmi088\?/);
  await choose([path.join(lot, "imu.log")], { rate: "100" });
  assert.match(await page.locator("#result .verdict").textContent(), /^[A-Z]/);
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
  assert.equal(await page.locator("#verdict").isVisible(), true);
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
