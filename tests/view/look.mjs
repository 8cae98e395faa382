// usage: node look.mjs PLAYWRIGHT_CORE CHROMIUM PROGRAM FOLDER SHARED [VALIDATE_JS]
// Opens pages of npt view in headless Chromium, as a user would from the disk, and looks: silhouettes, movement, colours of
// errors, buttons and keys; no error in the console and no request for anything but the page. Screenshots stay in FOLDER. Software draws
// them, some seconds each: NPT_LOOK=all in the environment looks at more of them, and at characters in SHARED.
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, readdirSync, readFileSync, statSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { inflateSync } from 'node:zlib';
import { Checks } from '../web/compare.mjs';
import { drawn, launch, runner, unreached, visit } from './browser.mjs';

const [library, chromium, npt, folder, shared, validator] = process.argv.slice(2);
mkdirSync(folder, { recursive: true });
process.chdir(folder);

const thorough = process.env.NPT_LOOK === 'all';

const checks = new Checks(), expect = checks.expect.bind(checks);
const run = runner(npt);

// ---- pictures ----

// RGB of a PNG of 8 bits without interlacing, which is what screenshots are.
function pixelsOf(png) {
  let at = 8, width = 0, height = 0, channels = 0;
  const parts = [];
  while (at < png.length) {
    const length = png.readUInt32BE(at), kind = png.toString('latin1', at + 4, at + 8), body = png.subarray(at + 8, at + 8 + length);
    if (kind === 'IHDR') {
      width = body.readUInt32BE(0), height = body.readUInt32BE(4);
      channels = body[9] === 6 ? 4 : 3;
    }
    if (kind === 'IDAT') parts.push(body);
    at += 12 + length;
  }
  const raw = inflateSync(Buffer.concat(parts)), stride = width * channels;
  const bytes = new Uint8Array(stride * height);
  for (let y = 0; y < height; ++y) {
    const filter = raw[y * (stride + 1)];
    for (let x = 0; x < stride; ++x) {
      const left = x >= channels ? bytes[y * stride + x - channels] : 0, up = y > 0 ? bytes[(y - 1) * stride + x] : 0;
      const corner = x >= channels && y > 0 ? bytes[(y - 1) * stride + x - channels] : 0;
      const p = left + up - corner;
      const paeth = Math.abs(p - left) <= Math.abs(p - up) && Math.abs(p - left) <= Math.abs(p - corner) ? left
        : Math.abs(p - up) <= Math.abs(p - corner) ? up : corner;
      bytes[y * stride + x] = raw[y * (stride + 1) + 1 + x] + [0, left, up, (left + up) >> 1, paeth][filter];
    }
  }
  return { width, height, at: (x, y) => [0, 1, 2].map((k) => bytes[(y * width + x) * channels + k]) };
}

// The canvas in cells of 8 x 8 of the page's pixels, each its mean colour. They are drawn at half of the resolution, which takes software
// a third of the time.
const cellSize = 4;
class Picture {
  constructor(png) {
    const pixels = pixelsOf(png);
    this.columns = Math.floor(pixels.width / cellSize), this.rows = Math.floor(pixels.height / cellSize);
    this.cells = [];
    for (let r = 0; r < this.rows; ++r)
      for (let c = 0; c < this.columns; ++c) {
        const sum = [0, 0, 0];
        for (let y = 0; y < cellSize; ++y)
          for (let x = 0; x < cellSize; ++x)
            pixels.at(cellSize * c + x, cellSize * r + y).forEach((v, k) => { sum[k] += v / cellSize ** 2; });
        this.cells.push(sum);
      }
  }
  cell(c, r) { return this.cells[r * this.columns + c]; }
  // Cells of part `i` of `n` side by side that differ from the background in their row's corner.
  figure(i, n, threshold = 24) {
    const found = [];
    const first = Math.floor(this.columns * i / n), last = Math.floor(this.columns * (i + 1) / n);
    for (let r = 0; r < this.rows - 6; ++r)
      for (let c = first; c < last; ++c) {
        const colour = this.cell(c, r), ground = this.cell(0, r);
        if (Math.max(...colour.map((v, k) => Math.abs(v - ground[k]))) > threshold) found.push({ c, r, colour });
      }
    return found;
  }
  difference(other) {
    let changed = 0;
    this.cells.forEach((colour, i) => { if (Math.max(...colour.map((v, k) => Math.abs(v - other.cells[i][k]))) > 12) changed += 1; });
    return changed;
  }
  brightness() { return this.cells.reduce((sum, c) => sum + c[0] + c[1] + c[2], 0) / this.cells.length / 3; }
}

// ---- the browser ----

const browser = await launch(library, chromium);

async function open(file, options = {}) {
  const { context, page, complaints } = await visit(browser, pathToFileURL(path.resolve(file)).href, {
    viewport: { width: 1000, height: 640 }, deviceScaleFactor: 0.5, ...options,
  });
  await page.waitForFunction(() => ['yes', 'failed'].includes(document.documentElement.dataset.ready), null, { timeout: 120000 });
  expect(await page.evaluate(() => document.documentElement.dataset.ready) === 'yes',
         `${file} doesn't show: ${await page.textContent('#message')}`);
  const look = async (name) => {
    await drawn(page);
    const png = await page.locator('#stage').screenshot();
    writeFileSync(`${name}.png`, png);
    return new Picture(png);
  };
  const close = async () => {
    expect(complaints.length === 0, `${file} complains: ${complaints.join(' | ')}`);
    await context.close();
  };
  return { page, look, close };
}

async function pair() {
  run('generate', '--out', 'bodies', '--count', '3', '--seed', '7');
  run('view', 'bodies/body_0000.ply', 'bodies/body_0001.ply', '--captions', 'identity,<b>pose</b>', '--colours', 'blue,sand', '--out', 'pair.html');
  const size = statSync('pair.html').size;
  expect(size < 1e6, `a pair of 6890 vertices takes ${size} bytes`);
  const { page, look, close } = await open('pair.html');
  const first = await look('pair');
  for (const i of [0, 1]) {
    const figure = first.figure(i, 2);
    expect(figure.length > 120, `panel ${i}: a figure of ${figure.length} cells`);
    const mean = [0, 1, 2].map((k) => figure.reduce((sum, cell) => sum + cell.colour[k], 0) / figure.length);
    expect(i === 0 ? mean[2] > mean[0] + 5 : mean[0] > mean[2] + 5, `panel ${i}: colour ${mean.map(Math.round)}`);
  }
  expect((await page.locator('#captions p').allTextContents()).join('|').startsWith('identity'), 'captions');
  expect(await page.locator('#captions b').count() === 0, 'a caption is taken for HTML');
  expect(await page.locator('#player').isHidden(), 'a pair has nothing to play');

  await page.click('#wire');
  const wire = await look('pair_wire');
  expect(first.difference(wire) > 40, 'the wireframe changes nothing');
  expect(await page.getAttribute('#wire', 'aria-pressed') === 'true', 'the button isn\'t pressed');
  await page.keyboard.press('w');
  let shown = await look('pair_again');
  expect(first.difference(shown) < 5, 'w doesn\'t take the wireframe away');
  const views = [['1', 'front'], ['2', 'side'], ['3', 'back'], ['ArrowLeft', 'turned'], ['+', 'near']];
  for (const [key, name] of thorough ? views : views.slice(1, 2)) {
    await page.locator('#canvas').focus();
    await page.keyboard.press(key);
    const now = await look(`pair_${name}`);
    expect(shown.difference(now) > 40, `${key} changes nothing`);
    shown = now;
  }
  // Both panels turn with one drag.
  await page.keyboard.press('r');
  await page.evaluate(() => document.activeElement.blur());
  const still = await look('pair_reset');
  expect(first.difference(still) < 5, 'r is not the first view');
  const box = await page.locator('#canvas').boundingBox();
  await page.mouse.move(box.x + 250, box.y + 200);
  await page.mouse.down();
  await page.mouse.move(box.x + 400, box.y + 200, { steps: 5 });
  await page.mouse.up();
  const turned = await look('pair_dragged');
  for (const i of [0, 1]) {
    const before = new Set(still.figure(i, 2).map(({ c, r }) => `${c},${r}`));
    const moved = turned.figure(i, 2).filter(({ c, r }) => !before.has(`${c},${r}`)).length;
    expect(moved > 15, `panel ${i} doesn't turn`);
  }
  await page.click('#theme');
  const dark = await look('pair_dark');
  expect(dark.brightness() < first.brightness() - 60, 'dark is not dark');
  expect(dark.figure(1, 2).length > 120, 'no figure in the dark');
  await page.keyboard.press('?');
  expect(await page.locator('#keys').isVisible(), 'no list of keys');
  await page.keyboard.press('Escape');
  // Every control can be reached by the keyboard.
  for (const id of await unreached(page, 20, ['canvas', 'wire', 'front', 'side', 'back', 'reset', 'theme', 'help']))
    expect(false, `${id} can't be reached by Tab`);
  await close();

  if (!thorough) return;
  const other = await open('pair.html', { colorScheme: 'dark' });
  expect((await other.look('pair_prefers_dark')).brightness() < first.brightness() - 60, 'the system\'s dark is ignored');
  await other.close();
  const phone = await open('pair.html', { viewport: { width: 390, height: 780 } });
  await phone.look('pair_phone');
  expect(await phone.page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'a narrow window scrolls sideways');
  await phone.close();
}

async function sequence() {
  // A body that is turned in steps; vertices of OBJ lines keep their number.
  run('generate', '--out', 'still.obj', '--seed', '3');
  const lines = readFileSync('still.obj', 'utf8').split('\n');
  mkdirSync('turn', { recursive: true });
  const frames = 12;
  for (let f = 0; f < frames; ++f) {
    const angle = Math.PI * f / frames;
    const text = lines.map((line) => {
      const [kind, x, y, z] = line.split(' ');
      if (kind !== 'v') return line;
      return `v ${x * Math.cos(angle) + z * Math.sin(angle)} ${y} ${z * Math.cos(angle) - x * Math.sin(angle)}`;
    });
    writeFileSync(`turn/frame_${String(f).padStart(2, '0')}.obj`, text.join('\n'));
  }
  run('view', 'still.obj', 'turn', '--out', 'turn.html', '--fps', '10');
  const { page, look, close } = await open('turn.html');
  expect(await page.textContent('#frame') === '1 / 12', `frame ${await page.textContent('#frame')}`);
  const first = await look('turn_01');
  await page.keyboard.press('End');
  expect(await page.textContent('#frame') === '12 / 12', 'End is not the last frame');
  await page.keyboard.press('Home');
  for (let i = 0; i < 6; ++i) await page.keyboard.press('.');
  expect(await page.textContent('#frame') === '7 / 12', 'six frames on is not frame 7');
  const seventh = await look('turn_07');
  expect(first.difference(seventh) > 60, 'a sequence that doesn\'t move');
  const half = (picture, i) => picture.figure(i, 2).length;
  expect(Math.abs(half(first, 0) - half(seventh, 0)) < 8, 'the mesh that stands still moves');
  await page.locator('#time').fill('0');
  expect(first.difference(await look('turn_scrubbed')) < 5, 'scrubbing to the start is not the first frame');
  await page.keyboard.press(' ');
  expect(await page.getAttribute('#play', 'aria-label') === 'Pause', 'space doesn\'t play');
  await page.waitForFunction(() => document.getElementById('frame').textContent !== '1 / 12', null, { timeout: 20000 });
  await page.click('#play');
  expect(await page.getAttribute('#play', 'aria-label') === 'Play', 'the button doesn\'t pause');
  await close();
  if (!thorough) return;
  const playing = await open('turn.html', { reducedMotion: 'no-preference' });
  expect(await playing.page.getAttribute('#play', 'aria-label') === 'Pause', 'a sequence doesn\'t start by itself');
  await playing.close();
}

async function heat() {
  // The body of the sequence with one hand lower, within its box: that hand is red, the rest as clay.
  const lines = readFileSync('still.obj', 'utf8').split('\n');
  const moved = lines.map((line) => {
    const [kind, x, y, z] = line.split(' ');
    return kind === 'v' && Number(x) > 0.35 ? `v ${x} ${Number(y) - 0.035} ${z}` : line;
  });
  writeFileSync('moved.obj', moved.join('\n'));
  run('view', 'moved.obj', 'still.obj', '--truth', 'still.obj,-', '--out', 'heat.html', '--captions', 'result,truth', '--scale-bar', '40');
  const { page, look, close } = await open('heat.html');
  await page.keyboard.press('1');
  const on = await look('heat');
  const red = (picture, i) => picture.figure(i, 2).filter(({ colour: [r, g, b] }) => r > 1.3 * g && r > 1.2 * b);
  expect(red(on, 0).length > 8, `${red(on, 0).length} red cells`);
  expect(red(on, 1).length === 0, 'the truth is red');
  // +x is on the right, seen from the front.
  const middle = on.columns / 4;
  expect(red(on, 0).filter(({ c }) => c > middle).length > 0.9 * red(on, 0).length, 'red on the wrong side');
  expect(await page.locator('#legend').isVisible(), 'no legend');
  expect((await page.textContent('#legend')).includes('40 mm'), `legend: ${await page.textContent('#legend')}`);
  await page.keyboard.press('h');
  expect(red(await look('heat_off'), 0).length === 0, 'h leaves the colours');
  expect(await page.locator('#legend').isHidden(), 'the legend stays');
  await page.click('#heat');
  const box = await page.locator('#canvas').boundingBox();
  for (const { c, r } of red(on, 0)) {
    await page.mouse.move(box.x + 8 * c + 4, box.y + 8 * r + 4);
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(done)));
    if (await page.textContent('#reading') !== '') break;
  }
  expect(/^\d+(\.\d)? mm$/.test(await page.textContent('#reading')), `under the pointer: ${await page.textContent('#reading')}`);
  await close();
}

async function glb(file, clip) {
  run('view', file, '--out', 'file.html');
  const { page, look, close } = await open('file.html');
  const name = path.basename(file, '.glb');
  if (clip !== undefined && await page.locator('#clips').isVisible()) await page.selectOption('#clip', { index: clip });
  await page.keyboard.press('Home');
  const first = await look(`glb_${name}`);
  expect(first.figure(0, 1).length > 100, `${name}: ${first.figure(0, 1).length} cells`);
  if (await page.locator('#player').isVisible()) {
    const frames = Number(await page.getAttribute('#time', 'max'));
    await page.locator('#time').fill(String(Math.floor(frames / 2)));
    expect(first.difference(await look(`glb_${name}_half`)) > 10, `${name} doesn't move`);
  }
  await page.click('#wire');
  await look(`glb_${name}_wire`);
  await close();
}

// What npt rig and npt transfer --clip write: the clip of one skeleton goes onto the joints of another, which then moves in three.js by
// them alone, beside the clip's skeleton. The files are left in made/ for the validator.
async function rigged() {
  mkdirSync('made', { recursive: true });
  // A body that walks forwards, turned frame by frame.
  run('generate', '--out', 'walker.obj', '--shape-seed', '2', '--pose', 'rest');
  const lines = readFileSync('walker.obj', 'utf8').split('\n');
  mkdirSync('steps', { recursive: true });
  const frames = 4;
  for (let f = 0; f < frames; ++f) {
    const angle = 0.5 * f;
    const text = lines.map((line) => {
      const [kind, x, y, z] = line.split(' ');
      if (kind !== 'v') return line;
      return `v ${x * Math.cos(angle) + z * Math.sin(angle)} ${y} ${z * Math.cos(angle) - x * Math.sin(angle) + 0.2 * f}`;
    });
    writeFileSync(`steps/frame_${f}.obj`, text.join('\n'));
  }
  run('rig', '--mesh', 'walker.obj', '--pose', 'steps', '--fps', '4', '--out', 'made/walker.glb');
  run('generate', '--out', 'body.obj', '--proportions', '--shape-seed', '41', '--pose', 'rest');
  run('rig', '--mesh', 'body.obj', '--names', 'mixamo', '--out', 'made/rig.glb');
  run('transfer', '--identity', 'made/rig.glb', '--pose', 'made/walker.glb', '--clip', 'steps', '--fps', '4', '--out', 'made/result.glb',
      '--view', 'result.html', '--report', 'result.jsonl');
  const report = JSON.parse(readFileSync('result.jsonl', 'utf8'));
  expect(report.status === 'done' && report.method === 'joints' && report.frames === frames, `report: ${JSON.stringify(report)}`);
  const { page, look, close } = await open('result.html');
  expect(await page.textContent('#frame') === '1 / 4', `frame ${await page.textContent('#frame')}`);
  await page.keyboard.press('1');
  const first = await look('rigged_1');
  const least = [20, 60];  // of the skeleton's thin bones, and of a body
  for (const i of [0, 1]) expect(first.figure(i, 2).length > least[i], `rigged: panel ${i} has ${first.figure(i, 2).length} cells`);
  await page.keyboard.press('End');
  const last = await look('rigged_4');
  const cells = (picture, i) => new Set(picture.figure(i, 2).map(({ c, r }) => `${c},${r}`));
  const moved = (i) => [...cells(last, i)].filter((cell) => !cells(first, i).has(cell)).length +
    [...cells(first, i)].filter((cell) => !cells(last, i).has(cell)).length;
  expect(moved(0) > 10, `the clip stands still: ${moved(0)} cells`);
  expect(moved(1) > 30, `the result stands still: ${moved(1)} cells`);
  await page.keyboard.press('w');
  const wire = await look('rigged_wire');  // of a file in its own colours
  const changed = last.figure(1, 2).filter(({ c, r, colour }) => Math.max(...wire.cell(c, r).map((v, k) => Math.abs(v - colour[k]))) > 3).length;
  expect(changed > 10, `rigged: the wireframe changes ${changed} cells of the result`);
  await close();
  if (thorough) await glb('made/rig.glb');
}

try {
  await pair();
  await sequence();
  await heat();
  await rigged();
  const files = shared && thorough ? ['Knight', 'Horse'].map((name) => path.join(shared, 'data/glb', `${name}.glb`)) : [];
  for (const file of files) {
    if (existsSync(file)) await glb(file, 1);
    else console.log(`${path.basename(file)} is not there: left out`);
  }
} finally {
  await browser.close();
}
if (validator) {
  const written = readdirSync('made').map((name) => path.join('made', name));
  try {
    execFileSync(process.execPath, [validator, ...written], { encoding: 'utf8' });
  } catch (error) {
    expect(false, `the validator: ${error.stdout}${error.stderr}`);
  }
}
checks.end();
