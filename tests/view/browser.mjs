// Pages in headless Chromium, for the tests that look at them.
import { execFileSync } from 'node:child_process';
import { createRequire } from 'node:module';

// `library`: npm's playwright-core. Software draws, wherever the tests run.
export function launch(library, executablePath) {
  const { chromium } = createRequire(import.meta.url)(library);
  return chromium.launch({ executablePath, args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-dev-shm-usage'] });
}

// A page in a context of its own, and what it complains of: errors and warnings, and requests that go anywhere but below its address or send
// anything.
export async function visit(browser, url, options) {
  const context = await browser.newContext({ reducedMotion: 'reduce', colorScheme: 'light', ...options });
  const page = await context.newPage();
  const complaints = [];
  // Drivers that render in software warn of their own slowness.
  page.on('console', (message) => {
    const own = !/GPU stall|software|swiftshader|GL Driver Message/i.test(message.text());
    if (message.type() === 'error' || (message.type() === 'warning' && own)) complaints.push(message.text());
  });
  page.on('pageerror', (error) => complaints.push(String(error)));
  page.on('request', (request) => {
    const to = request.url();
    if (![url, 'blob:', 'data:'].some((known) => to.startsWith(known))) complaints.push(`request: ${to}`);
    if (request.method() !== 'GET') complaints.push(`${request.method()} ${to}`);
  });
  await page.goto(url);
  return { context, page, complaints };
}

// Two frames: what was asked for is drawn by then.
export const drawn = (page) => page.evaluate(() => new Promise((done) => { requestAnimationFrame(() => requestAnimationFrame(done)); }));

// Those of the controls that so many presses of Tab don't come by.
export async function unreached(page, presses, ids) {
  const reached = new Set();
  for (let i = 0; i < presses; ++i) {
    await page.keyboard.press('Tab');
    reached.add(await page.evaluate(() => document.activeElement.id));
  }
  return ids.filter((id) => !reached.has(id));
}

// What runs npt: words to its output.
export const runner = (program) => (...words) => execFileSync(program, words, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });
