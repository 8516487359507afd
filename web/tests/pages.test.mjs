// The dashboard and a report in a real browser (Debian's Chromium), on a running rig.
//   node --test web/tests/pages.test.mjs            needs build/release/shiftrig and `npm ci` in web/
// SHIFTRIG names another program; SCREENSHOTS a folder for pictures at 1280 and 390 pixels.
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { after, before, test } from "node:test";
import { chromium } from "playwright-core";

const root = resolve(import.meta.dirname, "../..");
const shiftrig = process.env.SHIFTRIG ?? join(root, "build/release/shiftrig");
const folder = mkdtempSync(join(tmpdir(), "shiftrig-pages-"));
const pictures = process.env.SCREENSHOTS;
const patience = 20_000;

let browser, rig, url;
const complaints = [];

before(async () => {
  browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"] });
  rig = spawn(shiftrig, ["serve", "--scenario", join(root, "config/scenarios/plough_upshift.yaml"), "--duration", "600", "--port", "0", "--record", join(folder, "live.lcmlog")], { stdio: ["ignore", "pipe", "inherit"] });
  url = await new Promise((found, failed) => {
    let text = "";
    rig.stdout.on("data", (part) => { text += part; const line = /dashboard: (\S+)/.exec(text); if (line) found(line[1]); });
    rig.on("exit", (code) => failed(new Error(`shiftrig serve ended with ${code}`)));
  });
});

after(async () => {
  await browser?.close();
  rig?.kill("SIGTERM");
  await new Promise((done) => (rig?.exitCode === null ? rig.on("exit", done) : done()));
  assert.equal(rig.exitCode, 0, "shiftrig serve ends well on SIGTERM");
});

async function open(address, width) {
  const page = await browser.newPage({ viewport: { width, height: 900 }, acceptDownloads: true });
  page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
  page.on("pageerror", (error) => complaints.push(error.message));
  page.on("request", (request) => { const host = new URL(request.url()).hostname; if (host && host !== "127.0.0.1") complaints.push(`request to ${host}`); });
  await page.goto(address);
  return page;
}

const number = async (page, selector) => parseFloat((await page.textContent(selector)).replace(",", ""));
async function until(what, check) {
  const deadline = Date.now() + patience;
  for (;;) {
    if (await check()) return;
    assert.ok(Date.now() < deadline, `${what}: not within ${patience / 1000} s`);
    await new Promise((r) => setTimeout(r, 100));
  }
}

test("the dashboard follows the driver, shows a fault and gives the recording", async () => {
  const page = await open(url, 1280);
  await page.waitForSelector("[data-signal='mass.engine.speed']");
  const gear = "[data-signal='controller.current_gear']";
  await until("the scenario's shift to F3", async () => (await page.textContent(gear)) === "F3");
  await until("F3 shown locked", () => page.$("#device-F3.locked"));

  // The driver slows the engine and asks for F2.
  const before = await number(page, "[data-signal='mass.engine.speed']");
  await page.locator("[data-control='driver.throttle']").fill("0.45");
  await until("the engine slows", async () => (await number(page, "[data-signal='mass.engine.speed']")) < before - 150);
  await page.click("[data-control='driver.lever'][data-value='2']");
  await until("gear F2", async () => (await page.textContent(gear)) === "F2");
  await until("F2 shown locked", () => page.$("#device-F2.locked"));
  await until("F3 shown open", () => page.$("#device-F3.open"));
  await until("the shift is judged", async () => /F3 → F2/.test(await page.textContent("body")));
  if (pictures) await page.screenshot({ path: join(pictures, "dashboard-1280.png"), fullPage: true });

  // Pause holds simulated time, a step moves it by one tick.
  const tick = async () => Number(/tick (\d+)/.exec(await page.textContent("[data-role='health']"))[1]);
  await page.click("[data-role='pause']");
  await until("paused", async () => /paused/.test(await page.textContent("[data-role='health']")));
  await page.waitForTimeout(300);
  const held = await tick();
  await page.waitForTimeout(300);
  assert.equal(await tick(), held);
  await page.click("[data-role='step']");
  await until("one tick on", async () => (await tick()) === held + 1);
  await page.click("[data-role='pause']");

  // A lost sensor: the controller goes to limp.
  await page.click("[data-fault='output.dropout']");
  await until("the fault is an event", async () => /dropout/.test(await page.textContent("[aria-label='Events']")));
  await until("limp is said", async () => /limp/.test(await page.textContent("[role=status]")));
  if (pictures) await page.screenshot({ path: join(pictures, "dashboard-limp.png"), fullPage: true });
  await page.click("[data-fault='output.dropout']");

  // A parameter is changed while it runs, and the change is an event.
  await page.click("summary:text-is('F2')");
  await page.locator("[data-parameter='clutches.F2.wet_plates.mu_sliding']").fill("0.09");
  await page.locator("[data-parameter='clutches.F2.wet_plates.mu_sliding'] + button").click();
  await until("the parameter's event", async () => /mu_sliding is set to 0.09/.test(await page.textContent("[aria-label='Events']")));

  const download = page.waitForEvent("download");
  await page.click("[data-role='download']");
  const path = join(folder, "downloaded.lcmlog");
  await (await download).saveAs(path);
  assert.ok(statSync(path).size > 10_000);
  await page.close();
});

test("the dashboard works by keyboard and fits a phone", async () => {
  const page = await open(url, 390);
  await page.waitForSelector("[data-signal='mass.engine.speed']");
  assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= 390, "no sideways scrolling");
  await page.focus("[data-control='driver.throttle']");
  const throttle = await page.inputValue("[data-control='driver.throttle']");
  await page.keyboard.press("ArrowRight");
  assert.notEqual(await page.inputValue("[data-control='driver.throttle']"), throttle);
  if (pictures) await page.screenshot({ path: join(pictures, "dashboard-390.png"), fullPage: true });
  await page.close();
});

test("a viewer is told when the rig is gone", async () => {
  const other = spawn(shiftrig, ["serve", join(root, "config/tractor.yaml"), "--duration", "600", "--port", "0"], { stdio: ["ignore", "pipe", "ignore"] });
  const address = await new Promise((found) => other.stdout.on("data", (part) => found(/dashboard: (\S+)/.exec(part)[1])));
  const page = await browser.newPage();
  await page.goto(address);
  await page.waitForSelector(".gauge");
  other.kill("SIGKILL");
  await until("the loss is said", async () => /Connection to the rig lost|does not answer|has ended/.test(await page.textContent("[role=alert]")));
  await page.close();
});

test("a report opens, zooms and tells the scorecard", async () => {
  const recording = join(folder, "run.lcmlog"), html = join(folder, "report.html");
  for (const words of [["run", "--scenario", join(root, "config/scenarios/plough_upshift.yaml"), "--pace", "free", "--record", recording], ["report", recording, "-o", html]]) {
    const result = spawnSync(shiftrig, words, { encoding: "utf8" });
    assert.equal(result.status, 0, result.stderr);
  }
  for (const width of [1280, 390]) {
    const page = await open(`file://${html}`, width);
    assert.match(await page.textContent("#shifts"), /F2 → F3/);
    assert.match(await page.textContent("#shifts"), /duration/);
    assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= width, "no sideways scrolling");
    const range = () => page.evaluate(() => { const { min, max } = window.shiftrigPlots.charts[0].scales.x; return max - min; });
    const whole = await range();
    await page.click("text=Show in plots");
    await until("zoomed", async () => (await range()) < whole / 2);
    assert.ok((await page.evaluate(() => window.shiftrigPlots.charts.every((c) => c.scales.x.min === window.shiftrigPlots.charts[0].scales.x.min))), "all plots zoom together");
    await page.click("text=Whole run");
    await until("whole again", async () => (await range()) === whole);
    if (pictures) await page.screenshot({ path: join(pictures, `report-${width}.png`), fullPage: true });
    await page.close();
  }
});

test("no page complained and no request left this machine", () => assert.deepEqual(complaints, []));
